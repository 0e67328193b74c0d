"""What is known of the objects of the YCB set (Calli et al. 2015), whoever holds their meshes."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Any

import yaml

from graspbench.datasets import YCB_FILE

_NUMBERED = re.compile(r"\d{3}(?:-([a-z]))?_(.+)")


@dataclass(frozen=True)
class YcbFacts:
    """What is known of one object.

    Attributes:
        mass_kg: Its mass; None when it is not in the table.
        friction: Assumed Coulomb coefficient.
        licence: Licence of its model.
        source: Where the mass comes from.
    """

    mass_kg: float | None
    friction: float
    licence: str
    source: str


def short_name(name: str) -> str:
    """Return an object's name without its number: ``025_mug`` is the mug, ``065-d_cups`` are the d_cups."""
    numbered = _NUMBERED.fullmatch(name)
    if numbered is None:
        return name
    return "_".join(part for part in numbered.groups() if part)


def ycb_facts(name: str) -> YcbFacts:
    """Return what is known of the object of this name, with or without its number."""
    table = _table()
    mass = table["masses_kg"].get(short_name(name).lower())
    return YcbFacts(mass, table["friction"], table["licence"], table["source"])


@cache
def _table() -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(YCB_FILE.read_text(encoding="utf-8"))
    return content
