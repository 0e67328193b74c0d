"""What a field of a result means: the one place from which columns and their dictionary are described."""

import dataclasses
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator


@dataclass(frozen=True)
class About:
    """What a field of a result means; stands in the field's annotation.

    Attributes:
        meaning: What it says, one clause.
        unit: Its unit; None for what the end of its name says (``_m``, ``_deg``, ``_s``, ...).
        empty: When it has no value; None when it always has one.
        column: Whether tables have it; lists never are columns.
    """

    meaning: str
    unit: str | None = None
    empty: str | None = None
    column: bool = True


class Part:
    """A part of a result; its fields can also be read by the names that they have in ``result.json``."""

    def __getitem__(self, name: str) -> Any:
        """Return a field: ``result["local"]["q1"]`` is ``result.local.q1``."""
        field = next((each for each in _names(type(self)) if each.rstrip("_") == name), None)
        if field is None:
            raise KeyError(name)
        return getattr(self, field)


def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(kind))


def _number(value: Any) -> Any:
    """JSON knows no numbers that are not finite: they are written as null."""
    return float("nan") if value is None else value


Number = Annotated[float, BeforeValidator(_number)]
"""A number that may be nan, which JSON writes as null."""

_UNITS = {
    "_rad_s": "rad/s",
    "_kg": "kg",
    "_mm": "mm",
    "_deg": "deg",
    "_weight": "multiples of the weight",
    "_nm": "N m",
    "_n": "N",
    "_m": "m",
    "_s": "s",
}


def unit_of(name: str, described: str | None = None) -> str:
    """Return the unit of a field: what its description says, else what its name ends with."""
    if described is not None:
        return described
    return next((unit for ending, unit in _UNITS.items() if name.endswith(ending)), "")


def picked(kind: type, *sources: Any, **values: Any) -> Any:
    """Build a part of a result from the attributes of the same names that stages' dataclasses have.

    Args:
        kind: The part's dataclass.
        *sources: Objects whose attributes are taken, the first that has one.
        **values: Fields that are given outright.
    """
    for name in _names(kind):
        for source in sources:
            if name not in values and hasattr(source, name):
                values[name] = getattr(source, name)
    return kind(**values)
