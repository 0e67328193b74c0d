"""What the user knows of a hand, as text on the command line."""

from collections.abc import Sequence
from typing import cast, get_args

import numpy as np

from graspbench.errors import ConfigurationError
from graspbench.hand.importing.importer import Guesses
from graspbench.hand.parameters import TipShape


def guesses_of(
    *,
    palm: str | None,
    approach: str | None,
    fingers: int | None,
    drop: Sequence[str],
    tips: Sequence[str],
    tip_radius_mm: float | None,
    tip_shape: str,
    postures: Sequence[str],
    rests: Sequence[str],
    locks: Sequence[str],
    object_mm: float,
    package_dirs: Sequence[str],
) -> Guesses:
    """Read what was given.

    Raises:
        ConfigurationError: A text is not of the form that its option takes.
    """
    for option, length in (("--tip-radius-mm", tip_radius_mm), ("--object-mm", object_mm)):
        if length is not None and not 0.0 < length < np.inf:
            raise ConfigurationError(f"{option} is {length}", remedy="give a positive length in millimetres")
    direction = None if approach is None else _three(approach, "--approach", "X,Y,Z")
    if direction is not None and not any(direction):
        raise ConfigurationError(f"--approach {approach} has no direction", remedy="give X,Y,Z, not all 0")
    if tip_shape not in get_args(TipShape):
        raise ConfigurationError(
            f"--tip-shape is '{tip_shape}'", remedy=f"give {' or '.join(get_args(TipShape))}"
        )
    return Guesses(
        palm=palm,
        approach=direction,
        fingers=fingers,
        drop=tuple(drop),
        tips={name: _tip(value, name) for name, value in _pairs(tips, "--tip", "FINGER=LINK:X,Y,Z")},
        tip_radius_m=None if tip_radius_mm is None else 1e-3 * tip_radius_mm,
        tip_shape=cast(TipShape, tip_shape),
        postures_deg={n: _numbers(v, "--posture") for n, v in _pairs(postures, "--posture", "FINGER=A,B,C")},
        rests_deg={n: _numbers(v, "--rest") for n, v in _pairs(rests, "--rest", "FINGER=A,B,C")},
        locked_deg={n: _one(v, "--lock") for n, v in _pairs(locks, "--lock", "JOINT=DEG")},
        object_m=1e-3 * object_mm,
        package_dirs=tuple(package_dirs),
    )


def _pairs(texts: Sequence[str], option: str, form: str) -> list[tuple[str, str]]:
    found = []
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name or not value:
            raise ConfigurationError(
                f"{option} {text} is not of the form {form}", remedy=f"write {option} {form}"
            )
        found.append((name, value))
    return found


def _numbers(text: str, option: str) -> tuple[float, ...]:
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if not values or not np.all(np.isfinite(values)):
        raise ConfigurationError(
            f"{option} has '{text}' for numbers", remedy="write numbers with commas between"
        )
    return values


def _one(text: str, option: str) -> float:
    values = _numbers(text, option)
    if len(values) != 1:
        raise ConfigurationError(f"{option} has {len(values)} numbers", remedy="give one")
    return values[0]


def _three(text: str, option: str, form: str) -> tuple[float, float, float]:
    values = _numbers(text, option)
    if len(values) != 3:
        raise ConfigurationError(f"{option} has {len(values)} numbers", remedy=f"write {form}")
    return values[0], values[1], values[2]


def _tip(text: str, finger: str) -> tuple[str, tuple[float, float, float]]:
    link, _, centre = text.partition(":")
    x, y, z = _three(centre, "--tip", f"{finger}=LINK:X,Y,Z") if centre else (0.0, 0.0, 0.0)
    return link, (1e-3 * x, 1e-3 * y, 1e-3 * z)
