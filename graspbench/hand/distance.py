"""Compiled distance between boxes, segments and solid cylinders, the cores of a hand's rounded shapes."""

import math

from graspbench.arrays import FloatArray
from graspbench.compiled import compiled, inner

SEGMENT, BOX, CYLINDER = 0, 1, 2
ACCURACY_M = 2e-6
ITERATIONS = 200

Point = tuple[float, float, float]
Gap = tuple[float, float, float, float, float, float, float]


@inner
def nearest_in_core(kind: int, pose: FloatArray, size: FloatArray, x: float, y: float, z: float) -> Point:
    """Return the point of a solid core that is nearest to (x, y, z), the point itself if inside.

    Args:
        kind: SEGMENT, BOX or CYLINDER.
        pose: Orientation (columns 0 to 2) and centre (column 3) of the core, shape (3, 4).
        size: Half extents along its axes first, shape (>= 3,), m.
        x: Point.
        y: Point.
        z: Point.
    """
    x, y, z = x - pose[0, 3], y - pose[1, 3], z - pose[2, 3]
    a = pose[0, 0] * x + pose[1, 0] * y + pose[2, 0] * z
    b = pose[0, 1] * x + pose[1, 1] * y + pose[2, 1] * z
    c = pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z
    c = min(size[2], max(-size[2], c))
    if kind == CYLINDER:
        length = math.sqrt(a * a + b * b)
        if length > size[0]:
            a, b = a * size[0] / length, b * size[0] / length
    else:
        a = min(size[0], max(-size[0], a))
        b = min(size[1], max(-size[1], b))
    return (
        pose[0, 3] + pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c,
        pose[1, 3] + pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c,
        pose[2, 3] + pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c,
    )


@inner
def lowest_in_core(kind: int, pose: FloatArray, size: FloatArray, x: float, y: float, z: float) -> Point:
    """Return the core's point that is farthest against the direction (x, y, z)."""
    a = -(pose[0, 0] * x + pose[1, 0] * y + pose[2, 0] * z)
    b = -(pose[0, 1] * x + pose[1, 1] * y + pose[2, 1] * z)
    c = -(pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z)
    if kind == CYLINDER:
        length = math.sqrt(a * a + b * b)
        scale = size[0] / length if length > 1e-12 else 0.0
        a, b = a * scale, b * scale
    else:
        a, b = math.copysign(size[0], a), math.copysign(size[1], b)
    c = math.copysign(size[2], c)
    return (
        pose[0, 3] + pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c,
        pose[1, 3] + pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c,
        pose[2, 3] + pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c,
    )


@compiled
def core_distance(
    kind_a: int,
    pose_a: FloatArray,
    size_a: FloatArray,
    kind_b: int,
    pose_b: FloatArray,
    size_b: FloatArray,
    enough: float,
) -> Gap:
    """Return the distance of two cores and their nearest points (a, then b); 0 when they overlap.

    Projects in turn onto either core, extrapolated (Nesterov) with restarts; stops when the plane between
    the points proves the distance, or proves that it is more than ``enough``. What is returned is the
    proven lower bound.
    """
    if kind_a == SEGMENT and kind_b == SEGMENT:
        proven: Gap = _segment_distance(pose_a, size_a[2], pose_b, size_b[2])
        return proven
    bx, by, bz = pose_b[0, 3], pose_b[1, 3], pose_b[2, 3]
    ox, oy, oz = bx, by, bz
    ax = ay = az = bound = 0.0
    pace = 1.0
    for _ in range(ITERATIONS):
        after = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * pace * pace))
        ahead = (pace - 1.0) / after
        pace = after
        x, y, z = bx + ahead * (bx - ox), by + ahead * (by - oy), bz + ahead * (bz - oz)
        ox, oy, oz = bx, by, bz
        ax, ay, az = nearest_in_core(kind_a, pose_a, size_a, x, y, z)
        bx, by, bz = nearest_in_core(kind_b, pose_b, size_b, ax, ay, az)
        if (x - bx) * (bx - ox) + (y - by) * (by - oy) + (z - bz) * (bz - oz) > 0.0:
            pace = 1.0
        x, y, z = ax - bx, ay - by, az - bz
        distance = math.sqrt(x * x + y * y + z * z)
        if distance < ACCURACY_M:
            return 0.0, ax, ay, az, bx, by, bz
        x, y, z = x / distance, y / distance, z / distance
        px, py, pz = lowest_in_core(kind_a, pose_a, size_a, x, y, z)
        qx, qy, qz = lowest_in_core(kind_b, pose_b, size_b, -x, -y, -z)
        bound = max(bound, (px - qx) * x + (py - qy) * y + (pz - qz) * z)
        if distance - bound < ACCURACY_M or bound > enough:
            break
    return bound, ax, ay, az, bx, by, bz


@inner
def _segment_distance(pose_a: FloatArray, half_a: float, pose_b: FloatArray, half_b: float) -> Gap:
    """Closed form for two segments along the z axes of their poses (Ericson 2005, 5.1.9)."""
    gx, gy, gz = pose_b[0, 3] - pose_a[0, 3], pose_b[1, 3] - pose_a[1, 3], pose_b[2, 3] - pose_a[2, 3]
    ux, uy, uz = pose_a[0, 2], pose_a[1, 2], pose_a[2, 2]
    vx, vy, vz = pose_b[0, 2], pose_b[1, 2], pose_b[2, 2]
    along = ux * vx + uy * vy + uz * vz
    gap_a, gap_b = ux * gx + uy * gy + uz * gz, vx * gx + vy * gy + vz * gz
    spread = 1.0 - along * along
    s = (gap_a - along * gap_b) / spread if spread > 1e-12 else 0.0
    s = min(half_a, max(-half_a, s))
    t = min(half_b, max(-half_b, along * s - gap_b))
    s = min(half_a, max(-half_a, along * t + gap_a))
    ax, ay, az = pose_a[0, 3] + s * ux, pose_a[1, 3] + s * uy, pose_a[2, 3] + s * uz
    bx, by, bz = pose_b[0, 3] + t * vx, pose_b[1, 3] + t * vy, pose_b[2, 3] + t * vz
    distance = math.sqrt((ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2)
    return distance, ax, ay, az, bx, by, bz
