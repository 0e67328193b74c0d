"""Packages whose names load on first use, so that who needs one of them does not load all the others."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def loads_on_use(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return a package's ``__getattr__`` (PEP 562), which imports what a name stands for.

    Args:
        package: The package's ``__name__``.
        homes: For each public name the module that has it, relative to the package (``".results.store"`` is
            that of its sibling).
    """

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(f".{homes[name]}", package), name)

    return load
