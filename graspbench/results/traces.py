"""What a result says of the machine it was made on: nothing that was not asked for."""

import sys
import sysconfig
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import graspbench


def without_places(text: str) -> str:
    """Return text, a traceback for example, in which no path tells where the program or its user lives."""
    for place, word in _places():
        text = text.replace(f"{place}/", f"{word}/")
    return text


@lru_cache(maxsize=1)
def _places() -> tuple[tuple[str, str], ...]:
    """Return folders and what stands for them, the innermost first."""
    return tuple(sorted(set(_found()), key=lambda found: -len(found[0])))


def _found() -> Iterator[tuple[str, str]]:
    for name, word in (("purelib", "site-packages"), ("platlib", "site-packages"), ("stdlib", "python")):
        yield sysconfig.get_path(name), word
    yield str(Path(graspbench.__path__[0])), "graspbench"
    yield str(Path(graspbench.__path__[0]).parent), "."
    for folder in {sys.prefix, sys.base_prefix}:
        yield folder, "python"
    home = str(Path.home())
    if home.count("/") >= 1 and home != "/":
        yield home, "~"
