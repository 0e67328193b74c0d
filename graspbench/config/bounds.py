"""The values a number may have where its own option sets no narrower bound: by the unit in the option's name.

What is far beyond them is a slip of the pen, and many a loop would never end with it.
"""

import dataclasses
import math
import re
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic.fields import FieldInfo

from graspbench.errors import ConfigurationError


@dataclass(frozen=True)
class Bounds:
    """The range of a number.

    Attributes:
        low: Least value.
        high: Largest value.
        smallest: Least magnitude of a number that is not zero.
    """

    low: float
    high: float
    smallest: float = 0.0


# By the end of an option's name: the largest value, and the smallest that is not zero.
_BY_UNIT = (
    (r"_(m_s)", 10.0, 1e-6),
    (r"_(rad_s2)", 1e6, 1e-6),
    (r"_(kg_m3)", 1e5, 1e-3),
    (r"_(nm|nm_rad|nms_rad|n_per_m|ns_per_m)", 1e6, 1e-9),
    (r"_(n)", 1e6, 1e-9),
    (r"_(m)", 100.0, 1e-9),
    (r"_(s)", 3600.0, 1e-9),
    (r"_(hz)", 1e4, 1e-3),
    (r"_(deg)", 3600.0, 1e-6),
    (r"_(kg)", 1e3, 1e-9),
    (r"_(px)", 1e8, 0.0),
    (r"_(rgb)|rgba", 255.0, 0.0),
)
_ANY_NUMBER = (1e9, 1e-12)
_ANY_COUNT = 1e6
_SEED = "seed"
MAX_SEED = 2**63 - 1


@cache
def bounds_of(name: str, whole: bool, info: FieldInfo | None) -> Bounds:
    """Return the bounds of an option.

    Args:
        name: The option's name, without its section.
        whole: Whether only whole numbers are allowed.
        info: What the option's field itself says.
    """
    high, smallest = next(
        ((largest, least) for unit, largest, least in _BY_UNIT if re.search(f"(?:{unit})$", name)),
        (_ANY_COUNT, 0.0) if whole else _ANY_NUMBER,
    )
    if name == _SEED:
        high = float(MAX_SEED)
    own_low, own_high = _own(info, ("ge", "gt")), _own(info, ("le", "lt"))
    return Bounds(
        max(own_low) if own_low else -high,
        min(own_high) if own_high else high,
        min([smallest, *(each for each in own_high if each > 0)]),
    )


def _own(info: FieldInfo | None, sides: tuple[str, str]) -> list[float]:
    found = [getattr(item, side, None) for item in (info.metadata if info else ()) for side in sides]
    return [float(each) for each in found if each is not None]


def check_bounds(section: str, parameters: Any) -> None:
    """Refuse a number of a section that is not finite or out of its bounds.

    Args:
        section: Its dotted name, for the sentence.
        parameters: Its dataclass, validated otherwise.

    Raises:
        ConfigurationError: The message names the key, the value and the bounds.
    """
    kind: Any = type(parameters)
    for name, hint, info in fields_of(kind):
        value = getattr(parameters, name)
        if dataclasses.is_dataclass(value):
            check_bounds(f"{section}.{name}", value)
            continue
        for where, number in _numbers(value, f"{section}.{name}"):
            bounds = bounds_of(name, is_whole(hint), info if number is value else None)
            _check(where, number, bounds, scalar=number is value)


def _check(key: str, number: float, bounds: Bounds, scalar: bool) -> None:
    if not (isinstance(number, int) or math.isfinite(number)) or not bounds.low <= number <= bounds.high:
        remedy = f"give a number from {bounds.low:g} to {bounds.high:g}"
    elif scalar and 0 < abs(number) < bounds.smallest:
        remedy = f"give a number of at least {bounds.smallest:g}"
    else:
        return
    shown = f"{number:g}" if abs(number) < 1e300 else "an endless number"
    raise ConfigurationError(f"{key} = {shown} cannot be used", remedy=remedy, key=key)


def _numbers(value: Any, key: str) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a value with their keys, those of lists and mappings too."""
    if isinstance(value, bool):
        return
    if isinstance(value, int | float):
        yield key, value
    elif isinstance(value, Mapping):
        for name, item in value.items():
            yield from _numbers(item, f"{key}.{name}")
    elif isinstance(value, list | tuple):
        for k, item in enumerate(value):
            yield from _numbers(item, f"{key}[{k}]")


@cache
def fields_of(kind: Any) -> tuple[tuple[str, Any, FieldInfo | None], ...]:
    """Return the names, types and descriptions of a dataclass of parameters."""
    hints = typing.get_type_hints(kind, include_extras=True)
    found = []
    for each in dataclasses.fields(kind):
        hint, info = hints[each.name], None
        if typing.get_origin(hint) is typing.Annotated:
            hint, *extras = typing.get_args(hint)
            info = next((item for item in extras if isinstance(item, FieldInfo)), None)
        found.append((each.name, hint, info))
    return tuple(found)


def is_whole(hint: Any) -> bool:
    """Tell whether a type allows whole numbers alone."""
    kinds = {hint, *typing.get_args(hint)}
    return int in kinds and float not in kinds
