"""Plug points: a thing is registered where it is written, and found by its name.

A registry imports the modules of its own package when it is asked, so a new file with a registered class
or function is all that an addition takes. Asked for one name, it imports the module of that name alone, if
there is one. Other distributions register through the entry point group ``graspbench.<kind>``.
"""

import importlib
import pkgutil
from collections.abc import Callable, Iterator
from importlib.metadata import entry_points
from typing import Generic, TypeVar

from graspbench.errors import ConfigurationError

T = TypeVar("T")


class Registry(Generic[T]):
    """Named things of one kind.

    Args:
        kind: What the things are, as in the configuration ("index", "measure", "task").
        package: The package whose modules register the built-in ones.
    """

    def __init__(self, kind: str, package: str) -> None:
        self.kind = kind
        self._package = package
        self._items: dict[str, T] = {}
        self._loaded = False

    def register(self, name: str) -> Callable[[T], T]:
        """Return a decorator that registers its argument under ``name``."""

        def decorate(item: T) -> T:
            self._items[name] = item
            return item

        return decorate

    def names(self) -> tuple[str, ...]:
        """Return all names, sorted."""
        self._load()
        return tuple(sorted(self._items))

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def __getitem__(self, name: str) -> T:
        """Return the thing called ``name``.

        Raises:
            ConfigurationError: There is none; the message lists the names there are.
        """
        if name not in self._items and not self._load_module_of(name):
            self._load()
        try:
            return self._items[name]
        except KeyError:
            raise ConfigurationError(
                f"unknown {self.kind} '{name}'",
                remedy=f"choose one of {', '.join(self.names())}",
                kind=self.kind,
                name=name,
            ) from None

    def _load_module_of(self, name: str) -> bool:
        """Import the module that is called like a thing; return whether it registers that thing."""
        package = importlib.import_module(self._package)
        if name in {module.name for module in pkgutil.iter_modules(package.__path__)}:
            importlib.import_module(f"{self._package}.{name}")
        return name in self._items

    def _load(self) -> None:
        if self._loaded:
            return
        self._loaded = True
        package = importlib.import_module(self._package)
        for module in pkgutil.iter_modules(package.__path__):
            importlib.import_module(f"{self._package}.{module.name}")
        for point in entry_points(group=f"graspbench.{self.kind}"):
            self._items.setdefault(point.name, point.load())
