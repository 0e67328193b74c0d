"""The units of a mesh file: given, or guessed from its size."""

from typing import Literal

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import MeshError

Scale = float | Literal["guess"]
"""Metres per unit of a file, or that they are to be guessed."""

_UNITS_M = {"metres": 1.0, "millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254, "kilometres": 1000.0}
_GRASPABLE_M = (0.02, 0.5)


def to_metres(vertices: FloatArray, scale: Scale, name: str) -> tuple[FloatArray, tuple[str, ...]]:
    """Return vertices in metres, and the warning of a guess.

    Args:
        vertices: Shape (n, 3), in units of the file.
        scale: Metres per unit, or "guess".
        name: What to call the mesh in sentences.

    Raises:
        MeshError: No unit makes the mesh fit a hand.
    """
    if scale != "guess":
        return vertices * scale, ()
    finite = vertices[np.all(np.isfinite(vertices), axis=1)]
    largest = float(np.ptp(finite, axis=0).max()) if len(finite) else 0.0
    if (unit := _guess_unit(largest)) is None:
        raise MeshError(
            f"{name} is {largest:.3g} large, which no usual unit makes fit a hand",
            remedy="set object.scale to its metres per unit",
            kind="units",
        )
    factor = _UNITS_M[unit]
    size = f"{1e3 * factor * largest:.3g} mm"
    warning = f"{name} was guessed to be in {unit}, and so to be {size} large"
    return vertices * factor, (warning,)


def guess_scale(largest: float) -> float | None:
    """Return the metres per unit that make something of this size fit a hand; None when no unit does."""
    unit = _guess_unit(largest)
    return None if unit is None else _UNITS_M[unit]


def _guess_unit(largest: float) -> str | None:
    for unit, scale in _UNITS_M.items():
        if _GRASPABLE_M[0] <= largest * scale <= _GRASPABLE_M[1]:
            return unit
    return None
