"""The smallest support on the spherical polygon that is left free by a base of facets' corners.

See `graspbench.grasp.epsilon`. The polygon is cut out by the corners one by one; only what cuts off the
present least point is looked at.
"""

from typing import Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import inner

_INSIDE = 1e-14  # a corner this little beyond a cut stays: rounding, far less than corners are displaced


@inner
def least_on_polygon(
    columns: FloatArray,
    basis: FloatArray,
    cuts: FloatArray,
    polygons: FloatArray,
    best: float,
    ray: FloatArray,
) -> float:
    """Return the least support on a base's polygon, or ``best`` if that is less.

    Args:
        columns: Corners of all contacts, a one below each, shape (d + 1, n_f n_v).
        basis: What the base leaves free; its first three rows count, shape (d + 1, d + 1).
        cuts: Work space, shape (3, n_f n_v).
        polygons: Work space, shape (2, n, 3).
        best: What is known already.
        ray: Where what is less is written: its direction and offset, shape (d + 1,).
    """
    for a in range(3):
        for j in range(cuts.shape[1]):
            cuts[a, j] = 0.0
        for b in range(basis.shape[1]):
            for j in range(cuts.shape[1]):
                cuts[a, j] += basis[a, b] * columns[b, j]
    _first_polygon(cuts, polygons[0])
    count: Any = np.int64(4)
    side: Any = np.int64(0)
    while count > 0:
        polygon = polygons[side]
        least: Any = np.int64(-1)
        value = best
        for k in range(count):
            minus, length = _value(polygon[k], basis)
            if minus < value * length:
                least, value = np.int64(k), minus / length
        if least < 0:
            return best
        worst = _worst_cut(cuts, polygon[least])
        height = _height(cuts, worst, polygon[least])
        if height <= _INSIDE:
            for b in range(basis.shape[1]):
                ray[b] = 0.0
                for a in range(3):
                    ray[b] += polygon[least, a] * basis[a, b]
            return value
        count = _cut(polygon, count, cuts, worst, polygons[1 - side])
        side = 1 - side
    return best


@inner
def _first_polygon(cuts: FloatArray, polygon: FloatArray) -> None:
    """Write four points round the lune that two cuts leave."""
    first, second, longest, widest = 0, 0, 0.0, 0.0
    for j in range(cuts.shape[1]):
        square = cuts[0, j] ** 2 + cuts[1, j] ** 2 + cuts[2, j] ** 2
        if square > longest:
            first, longest = j, square
    for j in range(cuts.shape[1]):
        square = 0.0
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            square += (cuts[b, first] * cuts[c, j] - cuts[c, first] * cuts[b, j]) ** 2
        if square > widest:
            second, widest = j, square
    aa, bb, ab = 0.0, 0.0, 0.0
    for a in range(3):
        aa += cuts[a, first] ** 2
        bb += cuts[a, second] ** 2
        ab += cuts[a, first] * cuts[a, second]
    length = np.sqrt(max(widest, 1e-300))
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        polygon[0, a] = (cuts[b, first] * cuts[c, second] - cuts[c, first] * cuts[b, second]) / length
        polygon[1, a] = (ab * cuts[a, first] - aa * cuts[a, second]) / (np.sqrt(aa) * length)
        polygon[2, a] = -polygon[0, a]
        polygon[3, a] = (ab * cuts[a, second] - bb * cuts[a, first]) / (np.sqrt(bb) * length)


@inner
def _worst_cut(cuts: FloatArray, z: FloatArray) -> int:
    """Return the corner that is furthest beyond a point of the polygon."""
    worst, highest = 0, -np.inf
    for j in range(cuts.shape[1]):
        height = cuts[0, j] * z[0] + cuts[1, j] * z[1] + cuts[2, j] * z[2]
        if height > highest:
            worst, highest = j, height
    return worst


@inner
def _cut(polygon: FloatArray, count: int, cuts: FloatArray, j: int, out: FloatArray) -> int:
    """Write the part of a spherical polygon on the inner side of a cut; return how many corners it has."""
    left: Any = np.int64(0)
    leaves: Any = np.int64(0)  # where the way round goes out, and comes in again
    enters: Any = np.int64(0)
    before = count - 1
    height_before = _height(cuts, j, polygon[before])
    for k in range(count):
        height = _height(cuts, j, polygon[k])
        if height <= _INSIDE < height_before:
            enters = left
            if height < -_INSIDE:
                _cross(polygon[before], height_before, polygon[k], height, out[left])
                left += 1
        elif height_before <= _INSIDE < height:
            if height_before < -_INSIDE:
                _cross(polygon[k], height, polygon[before], height_before, out[left])
                left += 1
            leaves = left
        if height <= _INSIDE:
            for a in range(3):
                out[left, a] = polygon[k, a]
            left += 1
        before, height_before = k, height
    if left > 1:
        last, next_ = out[(leaves - 1) % left], out[enters % left]
        if last[0] * next_[0] + last[1] * next_[1] + last[2] * next_[2] < -0.5:
            left = _halve_edge(polygon, count, cuts, j, out, left, leaves)
    return int(left)


@inner
def _halve_edge(
    polygon: FloatArray, count: int, cuts: FloatArray, j: int, out: FloatArray, left: int, place: int
) -> int:
    """Insert a point into the edge that a cut made: half a great circle has no direction of its own."""
    inside, outside = np.zeros(3), np.zeros(3)
    for k in range(count):
        within = _height(cuts, j, polygon[k]) <= _INSIDE
        for a in range(3):
            if within:
                inside[a] += polygon[k, a]
            else:
                outside[a] += polygon[k, a]
    if inside[0] ** 2 + inside[1] ** 2 + inside[2] ** 2 < 1e-12:
        return left  # two opposite points are all that is left
    for k in range(left, place, -1):
        for a in range(3):
            out[k, a] = out[k - 1, a]
    _cross(outside, _height(cuts, j, outside), inside, _height(cuts, j, inside), out[place])
    return left + 1


@inner
def _height(cuts: FloatArray, j: int, z: FloatArray) -> float:
    return float(cuts[0, j] * z[0] + cuts[1, j] * z[1] + cuts[2, j] * z[2])


@inner
def _cross(above: FloatArray, height: float, below: FloatArray, depth: float, out: FloatArray) -> None:
    """Write the point between two others where the height is zero."""
    square = 0.0
    for a in range(3):
        out[a] = height * below[a] - depth * above[a]
        square += out[a] ** 2
    length = np.sqrt(max(square, 1e-300))
    for a in range(3):
        out[a] /= length


@inner
def _value(z: FloatArray, basis: FloatArray) -> tuple[float, float]:
    """Return minus the offset of what a point on the sphere stands for, and the length of its direction."""
    last = basis.shape[1] - 1
    minus = -(basis[0, last] * z[0] + basis[1, last] * z[1] + basis[2, last] * z[2])
    return float(minus), float(np.sqrt(max(1.0 - minus**2, 1e-20)))
