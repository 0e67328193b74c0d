"""Compiled clearances of a hand: between its links, to the ground and to points of an object.

Everything is in the palm frame. A clearance is negative by the depth of the overlap of the rounding
radii; overlapping cores give minus the sum of the radii.
"""

import math

import numpy as np
from numba import njit

from graspbench.arrays import FloatArray
from graspbench.hand.chains import Chains
from graspbench.hand.gjk import BOX, CYLINDER, SEGMENT, core_distance, support
from graspbench.hand.kinematics import forward
from graspbench.hand.shapes import Shapes


@njit(cache=True, nogil=True)
def place_finger(
    shapes: Shapes, f: int, rotations: FloatArray, origins: FloatArray,
    shape_rotations: FloatArray, shape_centres: FloatArray,
) -> None:
    """Compute the poses of the shapes of finger ``f`` (-1: of the palm).

    Args:
        shapes: The hand's shapes.
        f: Which finger.
        rotations: Orientations of its joint frames, shape (k, 3, 3).
        origins: Origins of its joint frames, shape (k, 3).
        shape_rotations: Output, shape (s, 3, 3).
        shape_centres: Output, shape (s, 3).
    """
    for s in range(shapes.finger.size):
        if shapes.finger[s] != f:
            continue
        if f < 0:
            shape_rotations[s] = shapes.rotations[s]
            shape_centres[s] = shapes.centres[s]
            continue
        r, o = rotations[shapes.link[s]], origins[shapes.link[s]]
        local, centre = shapes.rotations[s], shapes.centres[s]
        for i in range(3):
            shape_centres[s, i] = o[i] + r[i, 0] * centre[0] + r[i, 1] * centre[1] + r[i, 2] * centre[2]
            for j in range(3):
                shape_rotations[s, i, j] = r[i, 0] * local[0, j] + r[i, 1] * local[1, j] + r[i, 2] * local[2, j]


@njit(cache=True, nogil=True)
def place_hand(
    chains: Chains, shapes: Shapes, joints: FloatArray,
    rotations: FloatArray, origins: FloatArray, tips: FloatArray,
    shape_rotations: FloatArray, shape_centres: FloatArray,
) -> None:
    """Compute joint frames, tips and shape poses of the whole hand.

    Args:
        chains: The fingers.
        shapes: The hand's shapes.
        joints: Joints by finger, shape (f, k).
        rotations: Output, orientations of the joint frames, shape (f, k, 3, 3).
        origins: Output, origins of the joint frames, shape (f, k, 3).
        tips: Output, tip centres, shape (f, 3).
        shape_rotations: Output, shape (s, 3, 3).
        shape_centres: Output, shape (s, 3).
    """
    for f in range(chains.counts.size):
        forward(chains, f, joints[f], rotations[f], origins[f], tips[f])
        place_finger(shapes, f, rotations[f], origins[f], shape_rotations, shape_centres)
    place_finger(shapes, -1, rotations[0], origins[0], shape_rotations, shape_centres)


@njit(cache=True, nogil=True)
def pair_clearance(
    shapes: Shapes, a: int, b: int, shape_rotations: FloatArray, shape_centres: FloatArray,
    point_a: FloatArray, point_b: FloatArray,
) -> float:
    """Clearance between two shapes; nearest points of the cores in ``point_a`` and ``point_b``."""
    distance = core_distance(
        shapes.kind[a], shape_rotations[a], shape_centres[a], shapes.halves[a],
        shapes.kind[b], shape_rotations[b], shape_centres[b], shapes.halves[b],
        point_a, point_b,
    )  # fmt: skip
    return distance - shapes.radii[a] - shapes.radii[b]


@njit(cache=True, nogil=True)
def sphere_gap(shapes: Shapes, a: int, b: int, shape_centres: FloatArray) -> float:
    """Lower bound of the clearance of two shapes by their bounding spheres."""
    x = shape_centres[a, 0] - shape_centres[b, 0]
    y = shape_centres[a, 1] - shape_centres[b, 1]
    z = shape_centres[a, 2] - shape_centres[b, 2]
    return math.sqrt(x * x + y * y + z * z) - shapes.bounds[a] - shapes.bounds[b]


@njit(cache=True, nogil=True)
def hand_clearance(
    shapes: Shapes, shape_rotations: FloatArray, shape_centres: FloatArray, finger: int, cap: float
) -> float:
    """Smallest clearance between the hand's links, at most ``cap``.

    Args:
        shapes: The hand's shapes.
        shape_rotations: Their orientations, shape (s, 3, 3).
        shape_centres: Their centres, shape (s, 3).
        finger: Only pairs that this finger takes part in; -1 for all.
        cap: Clearances beyond this are not told apart.
    """
    point_a, point_b = np.empty(3), np.empty(3)
    least = cap
    for p in range(shapes.pairs.shape[0]):
        a, b = shapes.pairs[p, 0], shapes.pairs[p, 1]
        if finger >= 0 and shapes.finger[a] != finger and shapes.finger[b] != finger:
            continue
        if sphere_gap(shapes, a, b, shape_centres) < least:
            least = min(least, pair_clearance(shapes, a, b, shape_rotations, shape_centres, point_a, point_b))
    return least


@njit(cache=True, nogil=True)
def plane_clearance(
    shapes: Shapes, s: int, shape_rotations: FloatArray, shape_centres: FloatArray,
    normal: FloatArray, offset: float, point: FloatArray,
) -> float:
    """Clearance of one shape from the half-space normal . x <= offset; lowest core point in ``point``."""
    support(
        shapes.kind[s], shape_rotations[s], shape_centres[s], shapes.halves[s],
        -normal[0], -normal[1], -normal[2], point,
    )  # fmt: skip
    return normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2] - offset - shapes.radii[s]


@njit(cache=True, nogil=True)
def ground_clearance(
    shapes: Shapes, shape_rotations: FloatArray, shape_centres: FloatArray,
    normal: FloatArray, offset: float, finger: int, cap: float,
) -> float:
    """Smallest clearance of the hand (of one finger if ``finger`` >= 0) from the ground, at most ``cap``."""
    point = np.empty(3)
    least = cap
    for s in range(shapes.finger.size):
        if finger >= 0 and shapes.finger[s] != finger:
            continue
        c = shape_centres[s]
        height = normal[0] * c[0] + normal[1] * c[1] + normal[2] * c[2] - offset
        if height - shapes.bounds[s] < least:
            least = min(
                least, plane_clearance(shapes, s, shape_rotations, shape_centres, normal, offset, point)
            )
    return least


@njit(cache=True, nogil=True)
def nearest_core_point(
    kind: int, rotation: FloatArray, centre: FloatArray, half: FloatArray, point: FloatArray, out: FloatArray
) -> float:
    """Find the core's surface point nearest to ``point``; return the signed distance (negative inside)."""
    x, y, z = point[0] - centre[0], point[1] - centre[1], point[2] - centre[2]
    a = rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0] * z
    b = rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1] * z
    c = rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2] * z
    p, q, r, depth = a, b, c, 0.0
    if kind == SEGMENT:
        p, q, r = 0.0, 0.0, min(half[2], max(-half[2], c))
    elif kind == BOX:
        p = min(half[0], max(-half[0], a))
        q = min(half[1], max(-half[1], b))
        r = min(half[2], max(-half[2], c))
        if p == a and q == b and r == c:
            da, db, dc = half[0] - abs(a), half[1] - abs(b), half[2] - abs(c)
            depth = min(da, db, dc)
            if depth == da:
                p = math.copysign(half[0], a)
            elif depth == db:
                q = math.copysign(half[1], b)
            else:
                r = math.copysign(half[2], c)
    else:
        length = math.sqrt(a * a + b * b)
        scale = half[0] / length if length > 1e-12 else 1.0
        r = min(half[2], max(-half[2], c))
        if length > half[0]:
            p, q = a * scale, b * scale
        elif r == c:
            side, end = half[0] - length, half[2] - abs(c)
            depth = min(side, end)
            if side < end:
                p, q = a * scale, b * scale
            else:
                r = math.copysign(half[2], c)
    for row in range(3):
        out[row] = centre[row] + rotation[row, 0] * p + rotation[row, 1] * q + rotation[row, 2] * r
    if depth > 0.0:
        return -depth
    return math.sqrt((a - p) ** 2 + (b - q) ** 2 + (c - r) ** 2)


@njit(cache=True, nogil=True)
def object_clearance(
    shapes: Shapes, s: int, shape_rotations: FloatArray, shape_centres: FloatArray,
    obstacle: FloatArray, exempt: FloatArray, exempt_radius: float, cap: float,
    point: FloatArray, on_obstacle: FloatArray,
) -> float:
    """Smallest signed distance of one shape to points of an object, at most ``cap``.

    Args:
        shapes: The hand's shapes.
        s: Which shape.
        shape_rotations: Orientations of the shapes, shape (s, 3, 3).
        shape_centres: Centres of the shapes, shape (s, 3).
        obstacle: Points of the object, shape (m, 3).
        exempt: Points nearer than ``exempt_radius`` to this one do not count, shape (3,).
        exempt_radius: See above; 0 exempts nothing.
        cap: Distances beyond this are not told apart.
        point: Output, nearest point of the core, shape (3,).
        on_obstacle: Output, nearest point of the object, shape (3,).
    """
    least = cap
    trial = np.empty(3)
    c, r = shape_centres[s], shapes.radii[s]
    for i in range(obstacle.shape[0]):
        o = obstacle[i]
        reach = shapes.bounds[s] + least
        square = (o[0] - c[0]) ** 2 + (o[1] - c[1]) ** 2 + (o[2] - c[2]) ** 2
        if reach <= 0.0 or square >= reach * reach:
            continue
        if (o[0] - exempt[0]) ** 2 + (o[1] - exempt[1]) ** 2 + (o[2] - exempt[2]) ** 2 < exempt_radius**2:
            continue
        distance = (
            nearest_core_point(shapes.kind[s], shape_rotations[s], c, shapes.halves[s], o, trial) - r
        )
        if distance < least:
            least = distance
            for row in range(3):
                point[row], on_obstacle[row] = trial[row], o[row]
    return least
