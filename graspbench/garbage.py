"""How often Python looks for cyclic garbage."""

import gc

_THRESHOLDS = 100_000, 20, 100
"""Objects more than freed ones until the youngest are looked through, and how many looks until older ones."""


def collect_rarely() -> None:
    """Look for cyclic garbage rarely: loading the libraries makes a million objects that all stay.

    With Python's own thresholds every fifth second of loading goes into looking through them.
    """
    gc.set_threshold(*_THRESHOLDS)


def keep_what_is_loaded() -> None:
    """Look for garbage as usual again, and never at what is there now: before this process forks others."""
    gc.set_threshold(*_USUAL)
    gc.freeze()


_USUAL = gc.get_threshold()
