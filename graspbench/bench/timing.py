"""How long something takes."""

import gc
import time
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")


def best_time(once: Callable[[], Result], repeats: int) -> tuple[float, Result]:
    """Return the shortest of several wall clock times (s) and the last result.

    Other programs only ever make a run longer, so the shortest says most about the program itself. No
    first run is discarded: let one happen before where code is still to be compiled.
    """
    best, was = float("inf"), gc.isenabled()
    gc.disable()
    try:
        for _ in range(repeats):
            start = time.perf_counter()
            result = once()
            best = min(best, time.perf_counter() - start)
    finally:
        if was:
            gc.enable()
    return best, result
