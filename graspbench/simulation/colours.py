"""The colours of table and wall, chosen to contrast with the object where the scene leaves them open."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.scene import Colour, SceneParameters

CLOTHS: tuple[Colour, ...] = (
    (0.05, 0.46, 0.16),
    (0.04, 0.12, 0.66),
    (0.05, 0.46, 0.52),
    (0.42, 0.08, 0.60),
    (0.64, 0.05, 0.05),
    (0.66, 0.48, 0.04),
    (0.72, 0.72, 0.70),
    (0.64, 0.06, 0.42),
)
"""Table cloths to choose from."""

_OBJECT_SHADES = np.linspace(0.4, 1.05, 14)
_TABLE_SHADES = np.linspace(0.3, 1.2, 37)
_SECOND_SHADE = 0.62
_PALENESS = 0.35


@dataclass(frozen=True)
class SceneColours:
    """Unlit colours, RGB from 0 to 1.

    Attributes:
        first: The table's colour.
        second: Second colour of its pattern.
        wall: What lies beyond the table.
    """

    first: Colour
    second: Colour
    wall: Colour


def scene_colours(scene: SceneParameters, object_rgba: Sequence[float]) -> SceneColours:
    """Return the scene's colours; those left open contrast with the object.

    The table takes the cloth that differs most from the object, shaded or lit. The pattern's second
    colour is a darker shade of it. A wall behind a patterned table is paler than the table.
    """
    first = scene.table_rgb or contrasting_cloth(object_rgba)
    second = scene.table_second_rgb or _scaled(first, _SECOND_SHADE)
    pale = first if scene.table == "plain" else _mixed(first, (0.6, 0.6, 0.6), _PALENESS)
    return SceneColours(first, second, scene.wall_rgb or pale)


def contrasting_cloth(object_rgba: Sequence[float]) -> Colour:
    """Return the cloth whose every shade differs most from every shade of the object."""
    shades = _OBJECT_SHADES[:, None] * np.asarray(object_rgba[:3], dtype=np.float64)
    return max(CLOTHS, key=lambda cloth: _difference(shades, cloth))


def _difference(shades: FloatArray, cloth: Colour) -> float:
    """Least distance between the shades of the object and those of the cloth."""
    gaps = shades[:, None] - _TABLE_SHADES[:, None] * np.array(cloth)
    return float(np.linalg.norm(gaps, axis=2).min())


def _scaled(colour: Colour, factor: float) -> Colour:
    return (colour[0] * factor, colour[1] * factor, colour[2] * factor)


def _mixed(colour: Colour, other: Colour, share: float) -> Colour:
    red, green, blue = ((1.0 - share) * a + share * b for a, b in zip(colour, other, strict=True))
    return (red, green, blue)
