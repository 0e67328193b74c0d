"""How often Python looks for cyclic garbage while libraries are loaded, and when it ends."""

import gc
import sys

_THRESHOLDS, _USUAL = (100_000, 20, 100), gc.get_threshold()
"""Objects more than freed ones until the youngest are looked through, and how many looks until older ones."""


def load_quickly() -> None:
    """Look for cyclic garbage rarely from now on.

    Loading makes a million objects that all stay: with Python's own thresholds a fifth of it goes into
    looking through them.
    """
    gc.set_threshold(*_THRESHOLDS)


def keep_what_is_loaded() -> None:
    """Look for garbage as usual again, and never at what is there now: before this process forks others."""
    gc.set_threshold(*_USUAL)
    gc.freeze()


def leave_quickly() -> None:
    """Never look for garbage at what is there now: this process is about to end.

    Python looks through all of it several times on its way out, which took over a second after a trial. Not
    so with a library that complains on standard error of whatever it made and nobody freed.
    """
    if not _COMPLAINERS & sys.modules.keys():
        gc.freeze()


_COMPLAINERS = frozenset({"proxsuite"})
