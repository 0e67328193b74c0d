"""How long something takes."""

import gc
import time
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")


def best_time(once: Callable[[], Result], repeats: int) -> tuple[float, Result]:
    """Return the shortest of several processor times (s), all threads together, and the last result.

    Processor time does not count what other programs do in between; what these do to the caches only
    ever makes a run longer, so the shortest says most about the program itself. No first run is
    discarded: let one happen before where code is still to be compiled.
    """
    best, was = float("inf"), gc.isenabled()
    gc.disable()
    try:
        for _ in range(repeats):
            start = time.process_time()
            result = once()
            best = min(best, time.process_time() - start)
    finally:
        if was:
            gc.enable()
    return best, result
