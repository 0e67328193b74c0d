"""Compiled list of the gaps a hand has to close (tips to targets) or to keep (links to all else)."""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.hand.borders import lowest_point, sided_distance
from graspbench.hand.chains import Chains
from graspbench.hand.collision import far_apart, lowest_near, nearest_obstacle, tangent_plane, to_palm
from graspbench.hand.distance import Point, core_distance
from graspbench.hand.shapes import FINGER, IS_TIP, KIND, LINK, RADIUS, Shapes
from graspbench.hand.task import (
    EXEMPT,
    GROUND,
    HAND,
    HEIGHT,
    OBJECT,
    SHARPNESS,
    TURN,
    WORLD,
    System,
    Task,
)
from graspbench.hand.tip_support import C, H, has_surface, support

TIP_WEIGHT = 1e3  # a residual of 1 is a tip error of 1 mm
CLEARANCE_WEIGHT = 5e2
LEAN_WEIGHT = 30.0
MIN_LEAN, WANTED_LEAN = math.cos(math.radians(75.0)), math.cos(math.radians(65.0))
"""Cosines between a pad's direction and where a tip of its link's shape is touched: what is allowed, and what
the optimisation aims at."""

BUFFER_M = 0.002  # the optimisation aims this far beyond the margins


@inner
def _add_gap(
    system: System,
    count: int,
    residual: float,
    weight: float,
    n: Point,
    a: Point,
    b: Point,
    finger_a: int,
    link_a: int,
    finger_b: int,
    link_b: int,
) -> int:
    """Append a gap; return how many there are (a full list stays as it is)."""
    if count == system.gaps.shape[0]:
        return count
    gap, body = system.gaps[count], system.bodies[count]
    gap[0], gap[1], gap[2], gap[3], gap[4] = residual, weight, n[0], n[1], n[2]
    gap[5], gap[6], gap[7], gap[8], gap[9], gap[10] = a[0], a[1], a[2], b[0], b[1], b[2]
    gap[TURN], gap[TURN + 1], gap[TURN + 2] = 0.0, 0.0, 0.0
    body[0], body[1], body[2], body[3] = finger_a, link_a, finger_b, link_b
    return count + 1


@inner
def collect_tips(chains: Chains, task: Task, contact_of: IntArray, pose: FloatArray, system: System) -> int:
    """Collect the tips' distances from their targets along the palm's axes.

    Where a tip has its link's real shape, it is the point that touches the contact's tangent plane first.
    """
    count: int = np.int64(0)  # type: ignore[assignment]  # typed at once, not as a literal
    touch = system.touch
    for row in range(3 * contact_of.size):
        f, axis = row // 3, row % 3
        i = contact_of[f]
        if i < 0:
            continue
        if axis == 0 and has_surface(chains, f):
            _touch(chains, task, f, i, pose, system)
        target = to_palm(pose, task.targets[i])
        tip = (system.tips[f, 0], system.tips[f, 1], system.tips[f, 2])
        n = (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)
        gap = n[0] * (tip[0] - target[0]) + n[1] * (tip[1] - target[1]) + n[2] * (tip[2] - target[2])
        count = _add_gap(
            system, count, gap, TIP_WEIGHT, n, tip, target, f, chains.counts[f] - 1, WORLD, WORLD
        )
        if has_surface(chains, f):
            u, v, w = to_palm_turned(pose, task.normals[i])
            a, b, c = touch[H + 3 * axis], touch[H + 3 * axis + 1], touch[H + 3 * axis + 2]
            turn = system.gaps[count - 1]
            turn[TURN], turn[TURN + 1], turn[TURN + 2] = v * c - w * b, w * a - u * c, u * b - v * a
    return count


@inner
def _touch(chains: Chains, task: Task, f: int, i: int, pose: FloatArray, system: System) -> None:
    """Move a tip to the point of its shape that touches first at its contact."""
    frame, found = system.frames[f, chains.counts[f] - 1], system.touch
    u, v, w = to_palm_turned(pose, task.normals[i])
    support(chains, f, frame, -u, -v, -w, task.limits[SHARPNESS], found)
    for a in range(3):
        system.tips[f, a] = frame[a, 3]
        for b in range(3):
            system.tips[f, a] += frame[a, b] * found[C + b]


@inner
def to_palm_turned(pose: FloatArray, direction: FloatArray) -> Point:
    """Return a direction of the world in the palm frame of ``pose``, shape (3, 4)."""
    return (
        pose[0, 0] * direction[0] + pose[1, 0] * direction[1] + pose[2, 0] * direction[2],
        pose[0, 1] * direction[0] + pose[1, 1] * direction[1] + pose[2, 1] * direction[2],
        pose[0, 2] * direction[0] + pose[1, 2] * direction[1] + pose[2, 2] * direction[2],
    )


@inner
def lean_of(chains: Chains, task: Task, f: int, i: int, pose: FloatArray, frame: FloatArray) -> float:
    """Return the cosine between where a tip is touched and the direction of its pad."""
    u, v, w = to_palm_turned(pose, task.normals[i])
    x, y, z = _pad(chains, f, frame)
    cosine: float = -(u * x + v * y + w * z)
    return cosine


@inner
def _pad(chains: Chains, f: int, frame: FloatArray) -> Point:
    x, y, z = chains.pads[f, 0], chains.pads[f, 1], chains.pads[f, 2]
    return (
        frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z,
        frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z,
        frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z,
    )


@inner
def collect_pads(
    chains: Chains, task: Task, contact_of: IntArray, pose: FloatArray, system: System, count: int
) -> int:
    """Collect tips of real shapes that are touched too far from their pads."""
    nothing = (0.0, 0.0, 0.0)
    for f in range(contact_of.size):
        i = contact_of[f]
        if i < 0 or not has_surface(chains, f):
            continue
        last = chains.counts[f] - 1
        frame = system.frames[f, last]
        missing = lean_of(chains, task, f, i, pose, frame) - WANTED_LEAN
        if missing >= 0.0:
            continue
        before = count
        count = _add_gap(
            system, count, missing, LEAN_WEIGHT, nothing, nothing, nothing, f, last, WORLD, WORLD
        )
        if count > before:
            u, v, w = to_palm_turned(pose, task.normals[i])
            x, y, z = _pad(chains, f, frame)
            turn = system.gaps[before]
            turn[TURN], turn[TURN + 1], turn[TURN + 2] = v * z - w * y, w * x - u * z, u * y - v * x
    return count


@inner
def collect_world(
    chains: Chains,
    shapes: Shapes,
    task: Task,
    contact_of: IntArray,
    pose: FloatArray,
    system: System,
    count: int,
) -> int:
    """Collect what is too near to the ground, to the contacts' tangent planes and to the object."""
    for row in range(3 * shapes.index.shape[0]):
        s, which = row // 3, row % 3
        f, link = shapes.index[s, FINGER], shapes.index[s, LINK]
        last = f >= 0 and contact_of[f] >= 0 and link == chains.counts[f] - 1
        if which > 0 and shapes.index[s, IS_TIP] == 1:
            continue
        if which < 2:
            x, y, z, offset = pose[2, 0], pose[2, 1], pose[2, 2], task.limits[HEIGHT] - pose[2, 3]
            wanted = task.limits[GROUND] + BUFFER_M
            if which == 1:
                # The last link's end stays outside the tangent plane of its own contact.
                if not last:
                    continue
                i = contact_of[f]
                x, y, z, offset = tangent_plane(pose, task.points[i], task.normals[i], system.exempt)
                near, u, v, w = lowest_near(
                    shapes, s, system.poses[s], system.exempt, task.limits[EXEMPT], x, y, z
                )
                if not near:
                    continue
                wanted = 0.0 if has_surface(chains, f) else 0.5 * BUFFER_M
                a = (u, v, w)
            elif task.limits[HEIGHT] == -np.inf:
                continue
            else:
                a = lowest_point(shapes, s, system.poses[s], x, y, z)
            n, b = (x, y, z), a
            distance = x * a[0] + y * a[1] + z * a[2] - offset
        else:
            wanted = task.limits[OBJECT] + BUFFER_M
            radius = task.limits[EXEMPT] if last else 0.0
            i, distance = nearest_obstacle(
                shapes, system.poses, s, task.obstacle, pose, system.exempt, radius, wanted
            )
            if i < 0:
                continue
            b = to_palm(pose, task.obstacle.points[i])
            _, x, y, z = sided_distance(shapes, s, system.poses[s], b[0], b[1], b[2])
            n = (-x, -y, -z)
            a = (b[0] - distance * x, b[1] - distance * y, b[2] - distance * z)
        if distance < wanted:
            count = _add_gap(
                system, count, distance - wanted, CLEARANCE_WEIGHT, n, a, b, f, link, WORLD, WORLD
            )
    return count


@inner
def collect_hand(shapes: Shapes, task: Task, system: System, count: int) -> int:
    """Collect what of the hand is too near to the rest of the hand."""
    wanted = task.limits[HAND] + BUFFER_M
    for p in range(shapes.pairs.shape[0]):
        s, t = shapes.pairs[p, 0], shapes.pairs[p, 1]
        if far_apart(shapes, system.poses, s, t, wanted):
            continue
        radii = shapes.size[s, RADIUS] + shapes.size[t, RADIUS]
        gap, ax, ay, az, bx, by, bz = core_distance(
            shapes.index[s, KIND],
            system.poses[s],
            shapes.size[s],
            shapes.index[t, KIND],
            system.poses[t],
            shapes.size[t],
            wanted + radii,
        )
        distance = gap - radii
        if distance >= wanted:
            continue
        x, y, z = ax - bx, ay - by, az - bz
        if gap < 1e-5:
            # Cores that touch are pushed apart along the line of their centres.
            x = system.poses[s, 0, 3] - system.poses[t, 0, 3]
            y = system.poses[s, 1, 3] - system.poses[t, 1, 3]
            z = system.poses[s, 2, 3] - system.poses[t, 2, 3]
        length = math.sqrt(x * x + y * y + z * z) + 1e-12
        count = _add_gap(
            system,
            count,
            distance - wanted,
            CLEARANCE_WEIGHT,
            (x / length, y / length, z / length),
            (ax, ay, az),
            (bx, by, bz),
            shapes.index[s, FINGER],
            shapes.index[s, LINK],
            shapes.index[t, FINGER],
            shapes.index[t, LINK],
        )
    return count
