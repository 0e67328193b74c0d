"""Compiled optimisation of wrist pose and finger joints for given contacts.

The wrist floats (6 DOF). Unknown are its pose and all joints; a Levenberg-Marquardt iteration brings
the tips to their targets and, with smaller weights, keeps the joints near their preferred posture and
palm and links clear of each other, the ground and the object. All of it happens in the palm frame: a
twist [v; w] of the palm moves a point y that rests in the world by -v - w x y.
"""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.hand.chains import (
    LEADER,
    LEADER_FINGER,
    LOWER,
    PREFERRED,
    RATIO,
    SLIDES,
    UPPER,
    Chains,
)
from graspbench.hand.collision import place_hand
from graspbench.hand.gaps import collect_hand, collect_pads, collect_tips, collect_world
from graspbench.hand.placement_step import copy_matrix, is_leader, leads, move_hand, solve_step
from graspbench.hand.shapes import Shapes
from graspbench.hand.task import TURN, WORLD, System, Task

CENTRING_WEIGHT = 0.25
SETTLED_M = 1e-8
WRIST_SHARE = 0.01  # m^2/rad^2: a shift of the wrist by 1 cm counts as a turn by 0.1 rad
TRIAL, PROMISING_COST = 8, 10.0  # evaluations after which a start that is not as good as that is given up


@inner
def _build(chains: Chains, joints: FloatArray, system: System, count: int) -> float:
    """Build the normal equations of all gaps and of the pull to the preferred joints; return the cost."""
    n, k = joints.shape
    size = system.row.size
    cost = 0.0
    for i in range(size):
        system.gradient[i] = 0.0
        for j in range(size):
            system.hessian[i, j] = 0.0
    for r in range(count):
        gap = system.gaps[r]
        x, y, z = gap[2], gap[3], gap[4]
        for i in range(size):
            system.row[i] = 0.0
        for end in range(2):
            sign = 1.0 - 2.0 * end
            f, link = system.bodies[r, 2 * end], system.bodies[r, 2 * end + 1]
            px, py, pz = gap[5 + 3 * end], gap[6 + 3 * end], gap[7 + 3 * end]
            if f == WORLD:
                # What rests in the world falls behind a moving palm, hence the two minus signs.
                system.row[0], system.row[1], system.row[2] = x, y, z
                system.row[3], system.row[4], system.row[5] = (
                    py * z - pz * y,
                    pz * x - px * z,
                    px * y - py * x,
                )
            elif f >= 0:
                for j in range(link + 1):
                    u, v, w = system.frames[f, j, 0, 2], system.frames[f, j, 1, 2], system.frames[f, j, 2, 2]
                    a, b = px - system.frames[f, j, 0, 3], py - system.frames[f, j, 1, 3]
                    c = pz - system.frames[f, j, 2, 3]
                    speed = x * (v * c - w * b) + y * (w * a - u * c) + z * (u * b - v * a)
                    if chains.kinds[f, j, SLIDES] == 1:
                        speed = x * u + y * v + z * w
                    leader = chains.kinds[f, j, LEADER_FINGER] * k + chains.kinds[f, j, LEADER]
                    system.row[6 + leader] += sign * speed * chains.limits[f, j, RATIO]
        _add_turn(chains, system, r, k, system.row)
        square = gap[1] * gap[1]
        cost += square * gap[0] * gap[0]
        for i in range(size):
            a = system.row[i] * square
            if a != 0.0:
                system.gradient[i] -= a * gap[0]
                for j in range(i + 1):
                    system.hessian[i, j] += a * system.row[j]
    for f in range(n):
        for j in range(chains.counts[f]):
            if not is_leader(chains, f, j):
                continue
            half = 0.5 * (chains.limits[f, j, UPPER] - chains.limits[f, j, LOWER])
            pull = CENTRING_WEIGHT * (joints[f, j] - chains.limits[f, j, PREFERRED]) / half
            i = 6 + f * k + j
            system.gradient[i] -= CENTRING_WEIGHT / half * pull
            system.hessian[i, i] += (CENTRING_WEIGHT / half) ** 2
            cost += pull * pull
    return cost


@inner
def _add_turn(chains: Chains, system: System, r: int, k: int, row: FloatArray) -> None:
    """Add how a gap changes because its first body turns: tips of real shapes touch elsewhere then."""
    gap, f = system.gaps[r], system.bodies[r, 0]
    x, y, z = gap[TURN], gap[TURN + 1], gap[TURN + 2]
    if x == 0.0 and y == 0.0 and z == 0.0:
        return
    row[3], row[4], row[5] = row[3] + x, row[4] + y, row[5] + z
    for j in range(system.bodies[r, 1] + 1):
        if chains.kinds[f, j, SLIDES] == 1:
            continue
        axis = system.frames[f, j]
        speed = x * axis[0, 2] + y * axis[1, 2] + z * axis[2, 2]
        leader = chains.kinds[f, j, LEADER_FINGER] * k + chains.kinds[f, j, LEADER]
        row[6 + leader] += speed * chains.limits[f, j, RATIO]


@compiled
def improve(
    chains: Chains,
    shapes: Shapes,
    task: Task,
    contact_of: IntArray,
    pose: FloatArray,
    joints: FloatArray,
    system: System,
    avoid: bool,
    iterations: int,
) -> float:
    """Levenberg-Marquardt on wrist pose and joints, in place.

    Args:
        chains: The fingers.
        shapes: The collision shapes.
        task: What to reach and to avoid.
        contact_of: Contact of each finger, -1 for none, shape (f,).
        pose: Pose of the palm frame in the world, shape (3, 4).
        joints: Joints by finger, shape (f, k).
        system: Work space, from ``make_system``.
        avoid: Whether clearances count.
        iterations: Most postures to evaluate.

    Returns:
        The cost reached.
    """
    n, k = joints.shape
    best, damping = np.inf, 1e-4
    for evaluation in range(iterations):
        if avoid and evaluation == TRIAL and best > PROMISING_COST:
            break
        place_hand(chains, shapes, joints, system.frames, system.tips, system.poses)
        count = collect_tips(chains, task, contact_of, pose, system)
        count = collect_pads(chains, task, contact_of, pose, system, count)
        if avoid:
            count = collect_world(chains, shapes, task, contact_of, pose, system, count)
            count = collect_hand(shapes, task, system, count)
        cost = _build(chains, joints, system, count)
        if cost < best:
            done = cost > 0.995 * best
            damping = max(damping * 0.2, 1e-7)
            best = cost
            copy_matrix(pose, system.best_pose)
            copy_matrix(joints, system.best_joints)
            if done:
                break
            copy_matrix(system.hessian, system.best_hessian)
            for f in range(n):
                for j in range(k):
                    i = 6 + f * k + j
                    used = j < chains.counts[f] and is_leader(chains, f, j)
                    used = used and (contact_of[f] >= 0 or leads(chains, f, j, contact_of))
                    low = used and joints[f, j] <= chains.limits[f, j, LOWER] and system.gradient[i] < 0.0
                    high = used and joints[f, j] >= chains.limits[f, j, UPPER] and system.gradient[i] > 0.0
                    system.frozen[i] = 1.0 if not used or low or high else 0.0
            for i in range(system.gradient.size):
                system.best_gradient[i] = system.gradient[i]
        else:
            damping *= 10.0
            if damping > 1e4:
                break
            copy_matrix(system.best_pose, pose)
            copy_matrix(system.best_joints, joints)
        while not solve_step(system, damping):
            damping *= 10.0
        move_hand(chains, pose, joints, system.step)
    copy_matrix(system.best_pose, pose)
    copy_matrix(system.best_joints, joints)
    return best


@compiled
def settle(
    chains: Chains,
    shapes: Shapes,
    task: Task,
    contact_of: IntArray,
    pose: FloatArray,
    joints: FloatArray,
    system: System,
    iterations: int,
) -> float:
    """Bring all tips exactly to their targets by the least motion of wrist and joints, in place.

    Newton steps of least norm. It is for fingers that cannot place their tips by themselves: of one or two
    joints, or with joints that follow others. Joints at a limit that a step would cross rest.

    Args:
        chains: The fingers.
        shapes: The collision shapes.
        task: What to reach.
        contact_of: Contact of each finger, -1 for none, shape (f,).
        pose: Pose of the palm frame in the world, shape (3, 4).
        joints: Joints by finger, shape (f, k).
        system: Work space, from ``make_system``.
        iterations: Most steps.

    Returns:
        The largest distance left between tip and target, m.
    """
    n, k = joints.shape
    size = system.row.size
    rows, gaps = np.zeros((3 * n, size)), np.zeros(3 * n)
    left = np.inf
    for _ in range(iterations):
        place_hand(chains, shapes, joints, system.frames, system.tips, system.poses)
        count = collect_tips(chains, task, contact_of, pose, system)
        left = 0.0
        for r in range(0, count, 3):
            square = system.gaps[r, 0] ** 2 + system.gaps[r + 1, 0] ** 2 + system.gaps[r + 2, 0] ** 2
            left = max(left, math.sqrt(square))
        if left < SETTLED_M:
            break
        rows[:] = 0.0
        for r in range(count):
            _tip_row(chains, system, r, k, rows[r])
            gaps[r] = -system.gaps[r, 0]
        for i in range(size):
            system.frozen[i] = 0.0
        for _blocked in range(n * k + 1):
            gram = np.zeros((count, count))
            for a in range(count):
                for b in range(count):
                    for i in range(size):
                        if system.frozen[i] == 0.0:
                            gram[a, b] += rows[a, i] * rows[b, i] * (WRIST_SHARE if i < 3 else 1.0)
                gram[a, a] += 1e-12
            weights = np.linalg.solve(gram, gaps[:count])
            blocked = False
            for i in range(size):
                system.step[i] = 0.0
                if system.frozen[i] == 0.0:
                    for a in range(count):
                        system.step[i] += rows[a, i] * weights[a] * (WRIST_SHARE if i < 3 else 1.0)
            for f in range(n):
                for j in range(chains.counts[f]):
                    i, value = 6 + f * k + j, joints[f, j]
                    low = value <= chains.limits[f, j, LOWER] and system.step[i] < 0.0
                    high = value >= chains.limits[f, j, UPPER] and system.step[i] > 0.0
                    if system.frozen[i] == 0.0 and (low or high):
                        system.frozen[i], blocked = 1.0, True
            if not blocked:
                break
        move_hand(chains, pose, joints, system.step)
    return left


@inner
def _tip_row(chains: Chains, system: System, r: int, k: int, row: FloatArray) -> None:
    """Write the derivative of a tip's gap by the wrist's twist and the joints that lead."""
    gap, f = system.gaps[r], system.bodies[r, 0]
    x, y, z = gap[2], gap[3], gap[4]
    px, py, pz = gap[8], gap[9], gap[10]
    row[0], row[1], row[2] = x, y, z
    row[3], row[4], row[5] = py * z - pz * y, pz * x - px * z, px * y - py * x
    for j in range(chains.counts[f]):
        u, v, w = system.frames[f, j, 0, 2], system.frames[f, j, 1, 2], system.frames[f, j, 2, 2]
        a, b = gap[5] - system.frames[f, j, 0, 3], gap[6] - system.frames[f, j, 1, 3]
        c = gap[7] - system.frames[f, j, 2, 3]
        speed = x * (v * c - w * b) + y * (w * a - u * c) + z * (u * b - v * a)
        if chains.kinds[f, j, SLIDES] == 1:
            speed = x * u + y * v + z * w
        row[6 + chains.kinds[f, j, LEADER_FINGER] * k + chains.kinds[f, j, LEADER]] += (
            speed * chains.limits[f, j, RATIO]
        )
    _add_turn(chains, system, r, k, row)
