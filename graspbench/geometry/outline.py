"""Plane curves that shapes are swept from: polylines with rounded corners."""

import math
from collections.abc import Sequence

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError

_ARC_STEP_RAD = math.radians(12.0)


def rounded_polyline(
    corners: FloatArray, radii: Sequence[float], step_m: float, *, closed: bool = False
) -> FloatArray:
    """Return points along a polyline whose corners are replaced by tangent arcs.

    Args:
        corners: Shape (k, 2), m.
        radii: Radius of each corner's arc, m; 0 keeps the corner sharp. The two ends of an open polyline
            have no arc.
        step_m: Largest distance of neighbouring points, m.
        closed: Whether the last corner joins the first one.

    Returns:
        Points in order, shape (n, 2); a closed outline does not repeat its first point.

    Raises:
        ConfigurationError: Two corners coincide, or an arc does not fit between its neighbours.
    """
    count = len(corners)
    following = np.roll(corners, -1, axis=0)
    lengths = np.linalg.norm(following - corners, axis=1)
    if np.any(lengths[: None if closed else -1] < 1e-9):
        raise ConfigurationError(
            "two neighbouring corners of an outline coincide", remedy="remove one of them"
        )
    directions = (following - corners) / np.maximum(lengths, 1e-9)[:, None]
    arcs = [
        corners[[i]]
        if not closed and i in (0, count - 1)
        else _arc(corners[i], directions[i - 1], directions[i], radii[i], step_m)
        for i in range(count)
    ]
    for i in range(count if closed else count - 1):
        straight = arcs[(i + 1) % count][0] - arcs[i][-1]
        if straight @ directions[i] < -1e-9:
            raise ConfigurationError(
                f"the rounding of corners {i} and {(i + 1) % count} of an outline does not fit between them",
                remedy="use smaller corner radii or a larger shape",
                corners=corners.tolist(),
                radii=list(radii),
            )
    points: list[FloatArray] = []
    for i, arc in enumerate(arcs):
        points.append(arc)
        if closed or i + 1 < count:
            points.append(_between(arc[-1], arcs[(i + 1) % count][0], step_m))
    return _without_repeats(np.concatenate(points), closed)


def _arc(
    corner: FloatArray, before: FloatArray, after: FloatArray, radius: float, step_m: float
) -> FloatArray:
    cosine = float(np.clip(before @ after, -1.0, 1.0))
    turn = math.atan2(before[0] * after[1] - before[1] * after[0], cosine)
    if radius <= 0.0 or abs(turn) < 1e-6:
        return corner[None, :]
    tangent = radius * math.tan(abs(turn) / 2.0)
    centre_direction = math.copysign(1.0, turn) * np.array([-before[1], before[0]])
    start = corner - tangent * before
    centre = start + radius * centre_direction
    pieces = max(math.ceil(abs(turn) / _ARC_STEP_RAD), math.ceil(abs(turn) * radius / step_m))
    angles = np.linspace(0.0, turn, pieces + 1)
    spoke = start - centre
    cosines, sines = np.cos(angles), np.sin(angles)
    arc: FloatArray = np.stack(
        [
            centre[0] + cosines * spoke[0] - sines * spoke[1],
            centre[1] + sines * spoke[0] + cosines * spoke[1],
        ],
        axis=1,
    )
    return arc


def _between(start: FloatArray, end: FloatArray, step_m: float) -> FloatArray:
    pieces = max(1, math.ceil(float(np.linalg.norm(end - start)) / step_m))
    shares = np.arange(1, pieces)[:, None] / pieces
    points: FloatArray = start + shares * (end - start)
    return points


def _without_repeats(points: FloatArray, closed: bool) -> FloatArray:
    gaps = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1)
    keep = gaps > 1e-7
    if not closed:
        keep[0] = True
    kept: FloatArray = points[keep]
    return kept
