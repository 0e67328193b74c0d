"""Compiled geometry of a shape's border towards the world: that of its core, or of its mesh's hull."""

import math

from graspbench.arrays import FloatArray
from graspbench.compiled import inner
from graspbench.hand.distance import Point, lowest_in_core, nearest_in_core
from graspbench.hand.shapes import CORNERS, KIND, PLANES, RADIUS, Shapes

INSIDE_M = 1e-9  # a point this near to a core is inside, but for rounding
Sided = tuple[float, float, float, float]


@inner
def lowest_point(shapes: Shapes, s: int, pose: FloatArray, x: float, y: float, z: float) -> Point:
    """Return the point of a shape that is farthest against a unit vector.

    Args:
        shapes: The hand's shapes.
        s: Which shape.
        pose: Its pose, shape (3, 4).
        x: Direction.
        y: Direction.
        z: Direction.
    """
    first, last = shapes.spans[s, CORNERS], shapes.spans[s, CORNERS + 1]
    if first == last:
        px, py, pz = lowest_in_core(shapes.index[s, KIND], pose, shapes.size[s], x, y, z)
        radius = shapes.size[s, RADIUS]
        return px - radius * x, py - radius * y, pz - radius * z
    a = pose[0, 0] * x + pose[1, 0] * y + pose[2, 0] * z
    b = pose[0, 1] * x + pose[1, 1] * y + pose[2, 1] * z
    c = pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z
    least, lowest = math.inf, first
    for i in range(first, last):
        height = a * shapes.corners[i, 0] + b * shapes.corners[i, 1] + c * shapes.corners[i, 2]
        if height < least:
            least, lowest = height, i
    a, b, c = shapes.corners[lowest, 0], shapes.corners[lowest, 1], shapes.corners[lowest, 2]
    return (
        pose[0, 3] + pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c,
        pose[1, 3] + pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c,
        pose[2, 3] + pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c,
    )


@inner
def sided_distance(shapes: Shapes, s: int, pose: FloatArray, x: float, y: float, z: float) -> Sided:
    """Return the distance of a point from a shape, negative inside, and the unit vector of the way out.

    Of a hull it is the largest distance from its planes, a lower bound outside beside edges and corners.

    Args:
        shapes: The hand's shapes.
        s: Which shape.
        pose: Its pose, shape (3, 4).
        x: Point.
        y: Point.
        z: Point.
    """
    first, last = shapes.spans[s, PLANES], shapes.spans[s, PLANES + 1]
    if first == last:
        return _from_core(shapes.index[s, KIND], pose, shapes.size[s], x, y, z)
    x, y, z = x - pose[0, 3], y - pose[1, 3], z - pose[2, 3]
    a = pose[0, 0] * x + pose[1, 0] * y + pose[2, 0] * z
    b = pose[0, 1] * x + pose[1, 1] * y + pose[2, 1] * z
    c = pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z
    largest, nearest = -math.inf, first
    for i in range(first, last):
        height = (
            a * shapes.planes[i, 0] + b * shapes.planes[i, 1] + c * shapes.planes[i, 2] - shapes.planes[i, 3]
        )
        if height > largest:
            largest, nearest = height, i
    a, b, c = shapes.planes[nearest, 0], shapes.planes[nearest, 1], shapes.planes[nearest, 2]
    return (
        largest,
        pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c,
        pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c,
        pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c,
    )


@inner
def _from_core(kind: int, pose: FloatArray, size: FloatArray, x: float, y: float, z: float) -> Sided:
    px, py, pz = nearest_in_core(kind, pose, size, x, y, z)
    u, v, w = x - px, y - py, z - pz
    length = math.sqrt(u * u + v * v + w * w)
    if length < INSIDE_M:
        length, u, v, w = core_depth(kind, pose, size, x, y, z)
        return -length - size[RADIUS], u, v, w
    return length - size[RADIUS], u / length, v / length, w / length


@inner
def core_depth(kind: int, pose: FloatArray, size: FloatArray, x: float, y: float, z: float) -> Sided:
    """Return how deep a point lies in a box or cylinder, and the unit vector of its shortest way out."""
    x, y, z = x - pose[0, 3], y - pose[1, 3], z - pose[2, 3]
    a = pose[0, 0] * x + pose[1, 0] * y + pose[2, 0] * z
    b = pose[0, 1] * x + pose[1, 1] * y + pose[2, 1] * z
    c = pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z
    depth, column, value = size[2] - abs(c), 2, c
    if size[0] - abs(a) < depth:
        depth, column, value = size[0] - abs(a), 0, a
    if size[1] - abs(b) < depth:
        depth, column, value = size[1] - abs(b), 1, b
    # A cylinder's shell is bounded by the box around it: the direction is near enough to leave it.
    sign = math.copysign(1.0, value)
    return depth, sign * pose[0, column], sign * pose[1, column], sign * pose[2, column]


@inner
def cuts_hull(
    shapes: Shapes, s: int, pose: FloatArray, depth: float, corners: FloatArray, work: FloatArray
) -> bool:
    """Tell whether a triangle comes deeper than ``depth`` into a hull, by clipping it with the hull's planes.

    Args:
        shapes: The hand's shapes.
        s: Which shape, one with a hull.
        pose: Its pose in the world, shape (3, 4).
        depth: Depth that is tolerated, m.
        corners: The triangle in the world, shape (3, 3).
        work: Work space, shape (2, 3 + planes, 3).
    """
    count, now = 3, 0
    for k in range(3):
        x, y, z = corners[k, 0] - pose[0, 3], corners[k, 1] - pose[1, 3], corners[k, 2] - pose[2, 3]
        for column in range(3):
            work[0, k, column] = pose[0, column] * x + pose[1, column] * y + pose[2, column] * z
    for p in range(shapes.spans[s, PLANES], shapes.spans[s, PLANES + 1]):
        plane, kept = shapes.planes[p], 0
        offset = plane[3] - depth
        for i in range(count):
            one, two = work[now, i], work[now, (i + 1) % count]
            here = plane[0] * one[0] + plane[1] * one[1] + plane[2] * one[2] - offset
            there = plane[0] * two[0] + plane[1] * two[1] + plane[2] * two[2] - offset
            if here <= 0.0:
                for column in range(3):
                    work[1 - now, kept, column] = one[column]
                kept += 1
            if (here < 0.0 and there > 0.0) or (here > 0.0 and there < 0.0):
                share = here / (here - there)
                for column in range(3):
                    work[1 - now, kept, column] = one[column] + share * (two[column] - one[column])
                kept += 1
        count, now = kept, 1 - now
        if count == 0:
            return False
    return True
