"""How much the fuzz tests try: a few cases by default, as many as GRASPBENCH_FUZZ says on request."""

import contextlib
import math
import os
import resource
import traceback
from collections.abc import Iterator

import pytest

_LIMIT_S = 300.0  # what any test may take
_MAX_MEMORY_KB = 4_000_000


class Budget:
    """A number of cases, and the limits of the test that tries them.

    Args:
        default: The number where GRASPBENCH_FUZZ names none.
        most: The largest that makes sense.
    """

    def __init__(self, default: int, most: float = math.inf) -> None:
        self.count = int(min(most, int(os.environ.get("GRASPBENCH_FUZZ", "") or default)))
        self._share = max(1.0, self.count / default)
        self._faults: list[str] = []

    @property
    def timeout(self) -> pytest.MarkDecorator:
        """Marks a test that may take as much longer as it tries more."""
        return pytest.mark.timeout(_LIMIT_S * self._share)

    @contextlib.contextmanager
    def case(self, name: object) -> Iterator[None]:
        """Try a case, and go on with the next whatever comes of it; `check` tells all that went wrong."""
        try:
            yield
        except Exception as error:
            where = "".join(traceback.format_tb(error.__traceback__)[-2:])
            self._faults.append(f"{name}: {type(error).__name__}: {str(error)[:2000]}\n{where}")

    def check(self) -> None:
        """Fail if any case went wrong, or if too much memory was taken."""
        faults, self._faults = self._faults, []
        assert not faults, f"{len(faults)} cases failed:\n" + "\n".join(faults[:20])
        self.check_memory()

    @staticmethod
    def check_memory() -> None:
        """Fail if this process, or one that it started, has ever taken more than 4 GB."""
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN):
            assert resource.getrusage(who).ru_maxrss < _MAX_MEMORY_KB
