"""Compiled clearances of a hand: between its links, to the ground and to points of an object.

Everything is in the palm frame. Shapes that overlap have a negative clearance, by the depth of the
rounding radii (cores that overlap count as touching).
"""

import math
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.hand.borders import lowest_point, sided_distance
from graspbench.hand.chains import Chains
from graspbench.hand.distance import core_distance
from graspbench.hand.kinematics import forward
from graspbench.hand.obstacle import Obstacle
from graspbench.hand.shapes import BOUND, FINGER, IS_TIP, KIND, LINK, PLANES, RADIUS, Shapes
from graspbench.hand.task import EXEMPT, HEIGHT, OBJECT, System, Task
from graspbench.hand.tip_support import has_surface

CLEARANCE_CAP_M = 0.05
OBJECT_CAP_M = 0.01  # more room to the object never decides
TOUCH_M = 9e-5  # how deep what touches may seem to be: a little less than the 0.1 mm that are tolerated
EVERY_FINGER: Any = np.int64(-1)  # a plain -1 would be a type of its own to the compiler


@inner
def place_shapes(shapes: Shapes, f: int, frames: FloatArray, poses: FloatArray) -> None:
    """Compute the poses of the shapes of finger ``f`` (-1: of the palm).

    Args:
        shapes: The hand's shapes.
        f: Which finger.
        frames: Its joint frames, shape (k, 3, 4).
        poses: Output, shape (s, 3, 4).
    """
    for s in range(poses.shape[0]):
        if shapes.index[s, FINGER] != f:
            continue
        j = shapes.index[s, LINK]
        for row in range(3):
            for column in range(4):
                if f < 0:
                    poses[s, row, column] = shapes.local[s, row, column]
                    continue
                value = frames[j, row, 3] if column == 3 else 0.0
                for i in range(3):
                    value += frames[j, row, i] * shapes.local[s, i, column]
                poses[s, row, column] = value


@inner
def place_hand(
    chains: Chains,
    shapes: Shapes,
    joints: FloatArray,
    frames: FloatArray,
    tips: FloatArray,
    poses: FloatArray,
) -> None:
    """Compute joint frames, tips and shape poses of the whole hand.

    Args:
        chains: The fingers.
        shapes: The hand's shapes.
        joints: Joints by finger, shape (f, k).
        frames: Output, joint frames, shape (f, k, 3, 4).
        tips: Output, tip centres, shape (f, 3).
        poses: Output, poses of the shapes, shape (s, 3, 4).
    """
    for f in range(-1, joints.shape[0]):
        if f >= 0:
            forward(chains, f, joints[f], frames[f], tips[f])
        place_shapes(shapes, f, frames[max(f, 0)], poses)


@inner
def far_apart(shapes: Shapes, poses: FloatArray, a: int, b: int, distance: float) -> bool:
    """Tell by their bounding spheres whether two shapes are farther apart than ``distance``."""
    square = 0.0
    for row in range(3):
        square += (poses[a, row, 3] - poses[b, row, 3]) ** 2
    reach = shapes.size[a, BOUND] + shapes.size[b, BOUND] + distance
    apart: bool = square > reach * reach
    return apart


@inner
def hand_clearance(shapes: Shapes, poses: FloatArray, finger: int, cap: float) -> float:
    """Return the smallest clearance between the hand's links, at most ``cap``.

    Args:
        shapes: The hand's shapes.
        poses: Their poses, shape (s, 3, 4).
        finger: Only pairs that this finger takes part in; -1 for all.
        cap: Clearances beyond this are not told apart.
    """
    least = cap
    for p in range(shapes.pairs.shape[0]):
        a, b = shapes.pairs[p, 0], shapes.pairs[p, 1]
        if finger >= 0 and shapes.index[a, FINGER] != finger and shapes.index[b, FINGER] != finger:
            continue
        if far_apart(shapes, poses, a, b, least):
            continue
        radii = shapes.size[a, RADIUS] + shapes.size[b, RADIUS]
        distance = core_distance(
            shapes.index[a, KIND],
            poses[a],
            shapes.size[a],
            shapes.index[b, KIND],
            poses[b],
            shapes.size[b],
            least + radii,
        )[0]
        least = min(least, distance - radii)
    return least


@inner
def ground_clearance(
    shapes: Shapes, poses: FloatArray, pose: FloatArray, height: float, finger: int, cap: float
) -> float:
    """Return the smallest clearance of the hand from the ground, at most ``cap``.

    Args:
        shapes: The hand's shapes.
        poses: Their poses in the palm frame, shape (s, 3, 4).
        pose: Pose of the palm frame in the world, shape (3, 4).
        height: Height of the ground in the world.
        finger: Only shapes of this finger; -1 for all.
        cap: Clearances beyond this are not told apart.
    """
    x, y, z, offset = pose[2, 0], pose[2, 1], pose[2, 2], height - pose[2, 3]
    least = cap
    for s in range(poses.shape[0]):
        if finger >= 0 and shapes.index[s, FINGER] != finger:
            continue
        px, py, pz = lowest_point(shapes, s, poses[s], x, y, z)
        least = min(least, x * px + y * py + z * pz - offset)
    return least


@inner
def nearest_obstacle(
    shapes: Shapes,
    poses: FloatArray,
    s: int,
    obstacle: Obstacle,
    pose: FloatArray,
    exempt: FloatArray,
    exempt_radius: float,
    cap: float,
) -> tuple[int, float]:
    """Find the object point that is nearest to (or deepest in) one shape.

    Args:
        shapes: The hand's shapes.
        poses: Their poses in the palm frame, shape (s, 3, 4).
        s: Which shape.
        obstacle: Points of the object's surface, in the world.
        pose: Pose of the palm frame in the world, shape (3, 4).
        exempt: Points nearer than ``exempt_radius`` to this one (palm frame) do not count, shape (3,).
        exempt_radius: See above; 0 exempts nothing.
        cap: Distances beyond this are not told apart.

    Returns:
        Its index (-1: none within ``cap``), and its signed distance or ``cap``.
    """
    least, nearest = cap, -1
    bound, pose_s = shapes.size[s, BOUND], poses[s]
    cx, cy, cz = poses[s, 0, 3], poses[s, 1, 3], poses[s, 2, 3]
    ex, ey, ez = exempt[0], exempt[1], exempt[2]
    for b in range(obstacle.blocks.shape[0]):
        x, y, z = to_palm(pose, obstacle.blocks[b])
        reach = bound + least + obstacle.blocks[b, 3]
        if (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2 >= reach * reach or reach <= 0.0:
            continue
        # No point of the block is nearer than its ball.
        if sided_distance(shapes, s, pose_s, x, y, z)[0] >= least + obstacle.blocks[b, 3]:
            continue
        for i in range(obstacle.starts[b], obstacle.starts[b + 1]):
            x, y, z = to_palm(pose, obstacle.points[i])
            reach = bound + least
            if (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2 >= reach * reach or reach <= 0.0:
                continue
            if (x - ex) ** 2 + (y - ey) ** 2 + (z - ez) ** 2 < exempt_radius * exempt_radius:
                continue
            distance = sided_distance(shapes, s, pose_s, x, y, z)[0]
            if distance < least:
                least, nearest = distance, i
    return nearest, least


@compiled
def measure_clearances(
    chains: Chains,
    shapes: Shapes,
    task: Task,
    contact_of: IntArray,
    pose: FloatArray,
    joints: FloatArray,
    system: System,
    out: FloatArray,
) -> None:
    """Measure a posture's clearances to the ground, within the hand, and to the object.

    A last link may touch, near its own contact: where it touches the object itself or, of its shapes that are
    near, the contact's tangent plane, it is given the margin as clearance.

    Args:
        chains: The fingers.
        shapes: The hand's shapes.
        task: What to avoid.
        contact_of: Contact of each finger or -1, shape (f,).
        pose: Pose of the palm frame in the world, shape (3, 4).
        joints: Joints by finger, shape (f, k).
        system: Work space.
        out: Output: clearances to ground and hand, at most ``CLEARANCE_CAP_M``, and to the object, at most
            ``OBJECT_CAP_M``, shape (3,).
    """
    poses = system.poses
    place_hand(chains, shapes, joints, system.frames, system.tips, poses)
    out[0] = CLEARANCE_CAP_M
    if task.limits[HEIGHT] > -np.inf:
        out[0] = ground_clearance(shapes, poses, pose, task.limits[HEIGHT], EVERY_FINGER, CLEARANCE_CAP_M)
    out[1] = hand_clearance(shapes, poses, EVERY_FINGER, CLEARANCE_CAP_M)
    out[2] = OBJECT_CAP_M
    for s in range(poses.shape[0]):
        if shapes.index[s, IS_TIP] == 1:
            continue
        f = shapes.index[s, FINGER]
        radius = 0.0
        if f >= 0 and contact_of[f] >= 0 and shapes.index[s, LINK] == chains.counts[f] - 1:
            radius = task.limits[EXEMPT]
            i = contact_of[f]
            x, y, z, offset = tangent_plane(pose, task.points[i], task.normals[i], system.exempt)
            distance = OBJECT_CAP_M
            near, px, py, pz = lowest_near(shapes, s, poses[s], system.exempt, radius, x, y, z)
            if near:
                distance = x * px + y * py + z * pz - offset
            distance = nearest_obstacle(shapes, poses, s, task.obstacle, pose, system.exempt, 0.0, distance)[
                1
            ]
            if has_surface(chains, f):
                distance += TOUCH_M  # it is what touches
            out[2] = min(out[2], distance + task.limits[OBJECT])
        out[2] = nearest_obstacle(shapes, poses, s, task.obstacle, pose, system.exempt, radius, out[2])[1]


@inner
def lowest_near(
    shapes: Shapes,
    s: int,
    pose: FloatArray,
    contact: FloatArray,
    radius: float,
    x: float,
    y: float,
    z: float,
) -> tuple[bool, float, float, float]:
    """Return the point of a last link that is farthest against a contact's normal, not far from the contact.

    Shapes that are farther away than ``radius``, and what of a mesh's hull is, only have to miss the object:
    real objects are not as wide as a tangent plane.

    Returns:
        Whether the shape is that near at all, and the point.
    """
    distance, u, v, w = sided_distance(shapes, s, pose, contact[0], contact[1], contact[2])
    if distance >= radius:
        return False, 0.0, 0.0, 0.0
    qx, qy, qz = -distance * u, -distance * v, -distance * w
    px, py, pz = lowest_point(shapes, s, pose, x, y, z)
    if shapes.spans[s, PLANES] == shapes.spans[s, PLANES + 1]:
        return True, px, py, pz
    dx, dy, dz = px - contact[0] - qx, py - contact[1] - qy, pz - contact[2] - qz
    # On the way from the point nearest to the contact to the lowest one, as far as the ball reaches.
    a, b = dx * dx + dy * dy + dz * dz, qx * dx + qy * dy + qz * dz
    c = qx * qx + qy * qy + qz * qz - radius * radius
    share = min(1.0, (math.sqrt(max(b * b - a * c, 0.0)) - b) / max(a, 1e-18))
    return (
        True,
        contact[0] + qx + share * dx,
        contact[1] + qy + share * dy,
        contact[2] + qz + share * dz,
    )


@inner
def to_palm(pose: FloatArray, point: FloatArray) -> tuple[float, float, float]:
    """Return a point of the world, its first three numbers, in the palm frame of ``pose``, shape (3, 4)."""
    x, y, z = point[0] - pose[0, 3], point[1] - pose[1, 3], point[2] - pose[2, 3]
    return (
        pose[0, 0] * x + pose[1, 0] * y + pose[2, 0] * z,
        pose[0, 1] * x + pose[1, 1] * y + pose[2, 1] * z,
        pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z,
    )


@inner
def tangent_plane(
    pose: FloatArray, point: FloatArray, normal: FloatArray, local: FloatArray
) -> tuple[float, float, float, float]:
    """Return a contact's tangent plane in the palm frame, (normal, offset); its point in ``local``."""
    local[0], local[1], local[2] = to_palm(pose, point)
    u = pose[0, 0] * normal[0] + pose[1, 0] * normal[1] + pose[2, 0] * normal[2]
    v = pose[0, 1] * normal[0] + pose[1, 1] * normal[1] + pose[2, 1] * normal[2]
    w = pose[0, 2] * normal[0] + pose[1, 2] * normal[1] + pose[2, 2] * normal[2]
    return u, v, w, u * local[0] + v * local[1] + w * local[2]
