"""What a trial is at, for whoever waits for it."""

import math
from typing import TYPE_CHECKING

from graspbench.cli.ticker import Activity
from graspbench.compiled import is_compiling

if TYPE_CHECKING:
    from graspbench.trial.clock import Watch


def stage_activity(watch: "Watch") -> Activity | None:
    """Return the stage that a trial is at, and how far the global search is, if there is one."""
    if not watch.stage:
        return None
    more = ("compiling inner loops, once",) if is_compiling() else ()
    return Activity(watch.stage, watch.began, more + _search_words(watch))


def _search_words(watch: "Watch") -> tuple[str, ...]:
    search = watch.search
    if search is None:
        return ()
    best, bound = search.best, search.upper_bound
    words = [f"best {best:.3g}" if best > -math.inf else "no grasp yet"]
    if math.isfinite(bound):
        words.append(f"at most {bound:.3g}")
        if best > -math.inf and bound > 0.0:
            words.append(f"gap {100.0 * max(0.0, 1.0 - best / bound):.0f} %")
    return tuple(words)
