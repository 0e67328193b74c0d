"""The real shapes of last links as elements of a convex hull, for contacts on what a finger really has."""

from collections.abc import Sequence
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio
import scipy.spatial

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.chains import DISC, ELEMENT, ROUND, SLIDES, Chains

_SHORT_M = 0.005  # a tip this near to its joint's axis tells no direction
_TIP_LENGTHS = 2.0
"""How much of a link counts as its tip, in radii: what is farther from its end may not touch."""


@dataclass(frozen=True)
class _Cut:
    """The half space of a link that is its tip: direction . x >= least."""

    direction: FloatArray
    least: float


def with_surfaces(
    chains: Chains,
    geometry: pinocchio.GeometryModel,
    frames: dict[int, tuple[int, int, pinocchio.SE3]],
    radius_m: float,
    names: tuple[str, ...],
    hand: str,
) -> Chains:
    """Return the chains with the collision shapes of their last links as tips.

    Of a link that turns about its joint, what is within two radii of its end counts.

    Args:
        chains: The fingers.
        geometry: The hand's collision geometry; meshes count as their convex hulls.
        frames: Fingers' joints, from ``extract_chains``.
        radius_m: Half the width of a fingertip.
        names: Names of the fingers.
        hand: Name of the hand, for error messages.

    Raises:
        HandError: A last link has no collision shape, or a flat one.
    """
    rows: list[FloatArray] = []
    ends = [0]
    for f, name in enumerate(names):
        items = []
        for item in geometry.geometryObjects:
            finger, link, turn = frames.get(item.parentJoint, (-1, -1, None))
            if finger == f and link == chains.counts[f] - 1:
                items.append((item.geometry, turn * item.placement))
        found = _elements(items, _outwards(chains, f), radius_m)
        if not len(found):
            raise HandError(
                f"the last link of finger '{name}' of hand '{hand}' has no collision shape to touch with",
                remedy="give it one, or set hand.tip_shape=sphere",
                finger=name,
            )
        rows.append(found)
        ends.append(ends[-1] + len(found))
    spans = np.column_stack((ends[:-1], ends[1:])).astype(np.int64)
    return chains._replace(elements=np.concatenate(rows), spans=spans)


def _outwards(chains: Chains, f: int) -> FloatArray | None:
    """Return the direction of a last link from its joint's axis to its tip; None where there is none."""
    last = int(chains.counts[f]) - 1
    away = chains.tips[f] * np.array([1.0, 1.0, 0.0])
    length = float(np.linalg.norm(away))
    if chains.kinds[f, last, SLIDES] == 1 or length < _SHORT_M:
        return None
    return np.asarray(away / length)


def _elements(
    items: Sequence[tuple[coal.CollisionGeometry, pinocchio.SE3]],
    outwards: FloatArray | None,
    radius_m: float,
) -> FloatArray:
    nothing = np.zeros((0, ELEMENT))
    whole = [shape_elements(shape, placement) for shape, placement in items]
    if outwards is None or not any(len(each) for each in whole):
        return np.concatenate([nothing, *whole])
    end = max(float(heights(each, outwards).max()) for each in whole if len(each))
    cut = _Cut(outwards, end - _TIP_LENGTHS * radius_m)
    return np.concatenate([nothing, *(_cut(each, cut) for each in whole if len(each))])


def heights(elements: FloatArray, direction: FloatArray) -> FloatArray:
    """Return the elements' support functions for a unit vector, shape (e,)."""
    along = elements[:, 3:6] @ direction
    across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    return np.asarray(elements[:, :3] @ direction + elements[:, DISC] * across + elements[:, ROUND])


def shape_elements(shape: coal.CollisionGeometry, placement: pinocchio.SE3) -> FloatArray:
    """Return a collision shape as elements, shape (e, 8); of a flat mesh none.

    Args:
        shape: A sphere, capsule, cylinder, box or mesh.
        placement: Where it is.
    """
    axis = placement.rotation[:, 2]
    if isinstance(shape, coal.Box):
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
        return _points(signs * np.asarray(shape.halfSide).ravel(), placement)
    if isinstance(shape, coal.Sphere):
        return np.array([[*placement.translation, *axis, 0.0, shape.radius]])
    if isinstance(shape, (coal.Capsule, coal.Cylinder)):
        rounded = isinstance(shape, coal.Capsule)
        sizes = (0.0, shape.radius) if rounded else (shape.radius, 0.0)
        ends = [placement.translation + side * shape.halfLength * axis for side in (-1.0, 1.0)]
        return np.array([[*end, *axis, *sizes] for end in ends])
    if hasattr(shape, "vertices"):
        vertices = np.array(shape.vertices(), dtype=float).reshape(-1, 3)
        try:
            hull = scipy.spatial.ConvexHull(vertices)
        except (scipy.spatial.QhullError, ValueError):
            return np.zeros((0, ELEMENT))
        return _points(vertices[hull.vertices], placement)
    return np.zeros((0, ELEMENT))


def _points(points: FloatArray, placement: pinocchio.SE3) -> FloatArray:
    rows = np.zeros((len(points), ELEMENT))
    rows[:, :3] = points @ placement.rotation.T + placement.translation
    rows[:, 5] = 1.0
    return rows


def _cut(elements: FloatArray, cut: _Cut) -> FloatArray:
    """Return what of one shape's elements is in the half space."""
    above = elements[:, :3] @ cut.direction - cut.least
    if np.all(above >= 0.0):
        return elements
    if len(elements) == 1:
        return elements[above + elements[:, ROUND] > 0.0]
    if np.all(above < 0.0):
        return elements[:0]
    if len(elements) == 2:  # the ends of a capsule or cylinder
        low, high = (0, 1) if above[0] < above[1] else (1, 0)
        kept = elements.copy()
        share = -above[low] / (above[high] - above[low])
        kept[low, :3] += share * (elements[high, :3] - elements[low, :3])
        return kept
    hull = scipy.spatial.ConvexHull(elements[:, :3])
    edges = np.vstack([hull.simplices[:, pair] for pair in ((0, 1), (1, 2), (2, 0))])
    a, b = edges[:, 0], edges[:, 1]
    crossing = above[a] * above[b] < 0.0
    a, b = a[crossing], b[crossing]
    share = above[a] / (above[a] - above[b])
    between = elements[a, :3] + share[:, None] * (elements[b, :3] - elements[a, :3])
    between = np.unique(np.round(between, 12), axis=0)  # of either triangle beside an edge
    new = np.zeros((len(between), ELEMENT))
    new[:, :3], new[:, 5] = between, 1.0
    return np.concatenate((elements[above >= 0.0], new))
