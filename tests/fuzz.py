"""How much the fuzz tests try: a few cases by default, as many as GRASPBENCH_FUZZ says on request."""

import math
import os
import resource

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

    @property
    def timeout(self) -> pytest.MarkDecorator:
        """Marks a test that may take as much longer as it tries more."""
        return pytest.mark.timeout(_LIMIT_S * self._share)

    @staticmethod
    def check_memory() -> None:
        """Fail if this process, or one that it started, has ever taken more than 4 GB."""
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN):
            assert resource.getrusage(who).ru_maxrss < _MAX_MEMORY_KB
