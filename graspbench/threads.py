"""How many threads this process may use: all cores of its own, or a share where trials run side by side."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

# Read by the libraries when they are loaded, once.
_POOLS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

_limit: int | None = None


def threads_available() -> int:
    """Return how many threads a computation may use at a time."""
    cores = len(os.sched_getaffinity(0))
    return cores if _limit is None else min(cores, _limit)


def share_threads(processes: int) -> None:
    """Keep this process to its share of the cores, as one of several that compute at the same time."""
    global _limit
    import cv2

    _limit = max(1, len(os.sched_getaffinity(0)) // processes)
    cv2.setNumThreads(_limit)


@contextmanager
def single_threaded_pools() -> Iterator[None]:
    """Let processes started in the block load their linear algebra with one thread each.

    A trial's matrices are small: further threads only wait for each other, and take the cores from other
    trials. What the user has set in the environment stays.
    """
    ours = [name for name in _POOLS if name not in os.environ]
    os.environ.update(dict.fromkeys(ours, "1"))
    try:
        yield
    finally:
        for name in ours:
            os.environ.pop(name, None)
