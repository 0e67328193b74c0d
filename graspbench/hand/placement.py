"""Compiled search for a wrist pose and finger joints that bring fingertips to given contacts.

The wrist floats (6 DOF). Unknown are its pose and all joints; a Levenberg-Marquardt iteration brings
the tips to their targets and, with smaller weights, keeps the joints near their preferred posture and
palm and links clear of each other, the ground and the object. All of it happens in the palm frame: a
twist [v; w] of the palm moves a point y that rests in the world by -v - w x y.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.hand import kinematics
from graspbench.hand.chains import Chains
from graspbench.hand.collision import (
    ground_clearance,
    hand_clearance,
    object_clearance,
    pair_clearance,
    place_hand,
    plane_clearance,
    sphere_gap,
)
from graspbench.hand.shapes import Shapes

TIP_WEIGHT = 1e3  # a residual of 1 is a tip error of 1 mm
CLEARANCE_WEIGHT = 5e2
CENTRING_WEIGHT = 0.25
BUFFER_M = 0.002  # the iteration aims this far beyond the margins
CLEARANCE_CAP_M = 0.05


class Task(NamedTuple):
    """What the hand has to reach and to avoid, in the world.

    Attributes:
        targets: Wanted tip centres, shape (m, 3).
        points: Contact points, shape (m, 3).
        normals: Outward unit normals, shape (m, 3).
        ground_height: Height of the ground; -inf without ground.
        obstacle: Points of the object's surface, shape (o, 3).
        exempt_radius: A distal link may be nearer than the margin to object points this close to its
            own contact; there the tangent plane bounds it.
        margins: Ground, hand, object, joint margin, singular value, shape (5,).
    """

    targets: FloatArray
    points: FloatArray
    normals: FloatArray
    ground_height: float
    obstacle: FloatArray
    exempt_radius: float
    margins: FloatArray


class Work(NamedTuple):
    """Work space of one search, allocated once."""

    rotations: FloatArray
    origins: FloatArray
    tips: FloatArray
    shape_rotations: FloatArray
    shape_centres: FloatArray
    obstacle: FloatArray
    hessian: FloatArray
    gradient: FloatArray
    step: FloatArray
    row: FloatArray
    jacobian: FloatArray
    point_a: FloatArray
    point_b: FloatArray
    exempt: FloatArray


@njit(cache=True, nogil=True)
def make_work(chains: Chains, shapes: Shapes, obstacles: int) -> Work:
    """Allocate the work space."""
    n, k = chains.lower.shape
    s, size = shapes.finger.size, 6 + n * k
    return Work(
        np.zeros((n, k, 3, 3)), np.zeros((n, k, 3)), np.zeros((n, 3)),
        np.zeros((s, 3, 3)), np.zeros((s, 3)), np.zeros((obstacles, 3)),
        np.zeros((size, size)), np.zeros(size), np.zeros(size), np.zeros(size),
        np.zeros((3, k)), np.zeros(3), np.zeros(3), np.zeros(3),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def to_palm(rotation: FloatArray, translation: FloatArray, point: FloatArray, out: FloatArray) -> None:
    """Map a point of the world into the palm frame of pose (rotation, translation)."""
    x, y, z = point[0] - translation[0], point[1] - translation[1], point[2] - translation[2]
    for row in range(3):
        out[row] = rotation[0, row] * x + rotation[1, row] * y + rotation[2, row] * z


@njit(cache=True, nogil=True)
def _turn(rotation: FloatArray, vector: FloatArray, out: FloatArray) -> None:
    for row in range(3):
        out[row] = (
            rotation[0, row] * vector[0] + rotation[1, row] * vector[1] + rotation[2, row] * vector[2]
        )


@njit(cache=True, nogil=True)
def _wrist_row(work: Work, normal: FloatArray, point: FloatArray, sign: float) -> None:
    """Set the wrist's part of a row: the rate at which ``point`` (at rest in the world) falls behind."""
    row = work.row
    for i in range(3):
        row[i] = sign * normal[i]
    row[3] = sign * (point[1] * normal[2] - point[2] * normal[1])
    row[4] = sign * (point[2] * normal[0] - point[0] * normal[2])
    row[5] = sign * (point[0] * normal[1] - point[1] * normal[0])


@njit(cache=True, nogil=True)
def _finger_row(
    chains: Chains, work: Work, f: int, link: int, point: FloatArray, normal: FloatArray, sign: float
) -> None:
    """Add a finger's part of a row: the speed along ``normal`` of a point on its link."""
    k = chains.lower.shape[1]
    kinematics.point_jacobian(link, work.rotations[f], work.origins[f], point, work.jacobian)
    for j in range(link + 1):
        work.row[6 + f * k + j] += sign * (
            normal[0] * work.jacobian[0, j] + normal[1] * work.jacobian[1, j] + normal[2] * work.jacobian[2, j]
        )


@njit(cache=True, nogil=True)
def _add_row(work: Work, residual: float, weight: float) -> float:
    """Add the row's square to the normal equations, clear the row; return its cost."""
    row, hessian, gradient = work.row, work.hessian, work.gradient
    size = row.size
    square = weight * weight
    for i in range(size):
        a = row[i] * square
        if a == 0.0:
            continue
        gradient[i] -= a * residual
        for j in range(i + 1):
            if row[j] != 0.0:
                hessian[i, j] += a * row[j]
    row[:] = 0.0
    return square * residual * residual


@njit(cache=True, nogil=True)
def _assemble(
    chains: Chains, shapes: Shapes, task: Task, contact_of: IntArray, rotation: FloatArray,
    translation: FloatArray, joints: FloatArray, work: Work, avoid: bool,
) -> float:
    """Build the normal equations at a posture and return its cost."""
    work.hessian[:] = 0.0
    work.gradient[:] = 0.0
    work.row[:] = 0.0
    n, k = chains.lower.shape
    place_hand(
        chains, shapes, joints, work.rotations, work.origins, work.tips, work.shape_rotations, work.shape_centres
    )
    cost = 0.0
    target, normal = np.empty(3), np.zeros(3)
    for f in range(n):
        if contact_of[f] < 0:
            continue
        to_palm(rotation, translation, task.targets[contact_of[f]], target)
        for axis in range(3):
            normal[:] = 0.0
            normal[axis] = 1.0
            _wrist_row(work, normal, target, 1.0)
            _finger_row(chains, work, f, chains.counts[f] - 1, work.tips[f], normal, 1.0)
            cost += _add_row(work, work.tips[f, axis] - target[axis], TIP_WEIGHT)
        for j in range(chains.counts[f]):
            half = 0.5 * (chains.upper[f, j] - chains.lower[f, j])
            work.row[6 + f * k + j] = 1.0 / half
            cost += _add_row(work, (joints[f, j] - chains.preferred[f, j]) / half, CENTRING_WEIGHT)
    if avoid:
        cost += _avoid_ground(chains, shapes, task, rotation, translation, work)
        cost += _avoid_object(chains, shapes, task, contact_of, rotation, translation, work)
        cost += _avoid_hand(chains, shapes, task, work)
    return cost


@njit(cache=True, nogil=True)
def _avoid_ground(
    chains: Chains, shapes: Shapes, task: Task, rotation: FloatArray, translation: FloatArray, work: Work
) -> float:
    cost = 0.0
    if task.ground_height == -np.inf:
        return cost
    normal = rotation[2].copy()
    offset = task.ground_height - translation[2]
    wanted = task.margins[0] + BUFFER_M
    for s in range(shapes.finger.size):
        c = work.shape_centres[s]
        if normal[0] * c[0] + normal[1] * c[1] + normal[2] * c[2] - offset - shapes.bounds[s] > wanted:
            continue
        distance = plane_clearance(
            shapes, s, work.shape_rotations, work.shape_centres, normal, offset, work.point_a
        )
        if distance < wanted:
            _wrist_row(work, normal, work.point_a, 1.0)
            if shapes.finger[s] >= 0:
                _finger_row(chains, work, shapes.finger[s], shapes.link[s], work.point_a, normal, 1.0)
            cost += _add_row(work, distance - wanted, CLEARANCE_WEIGHT)
    return cost


@njit(cache=True, nogil=True)
def _avoid_object(
    chains: Chains, shapes: Shapes, task: Task, contact_of: IntArray, rotation: FloatArray,
    translation: FloatArray, work: Work,
) -> float:
    cost = 0.0
    normal = np.empty(3)
    wanted = task.margins[2] + BUFFER_M
    for s in range(shapes.finger.size):
        if shapes.is_tip[s]:
            continue
        f = shapes.finger[s]
        radius = 0.0
        if f >= 0 and contact_of[f] >= 0 and shapes.link[s] == chains.counts[f] - 1:
            # The last link stays outside the tangent plane of its own contact.
            radius = task.exempt_radius
            to_palm(rotation, translation, task.points[contact_of[f]], work.exempt)
            _turn(rotation, task.normals[contact_of[f]], normal)
            offset = normal[0] * work.exempt[0] + normal[1] * work.exempt[1] + normal[2] * work.exempt[2]
            distance = plane_clearance(
                shapes, s, work.shape_rotations, work.shape_centres, normal, offset, work.point_a
            )
            if distance < 0.5 * BUFFER_M:
                _wrist_row(work, normal, work.point_a, 1.0)
                _finger_row(chains, work, f, shapes.link[s], work.point_a, normal, 1.0)
                cost += _add_row(work, distance - 0.5 * BUFFER_M, CLEARANCE_WEIGHT)
        distance = object_clearance(
            shapes, s, work.shape_rotations, work.shape_centres, work.obstacle, work.exempt, radius, wanted,
            work.point_a, work.point_b,
        )  # fmt: skip
        if distance < wanted:
            length = 0.0
            for i in range(3):
                normal[i] = work.point_a[i] - work.point_b[i]
                length += normal[i] ** 2
            length = math.sqrt(length)
            if length < 1e-9:
                continue
            # Inside the core the way out is from the object's point towards the core's surface, reversed.
            sign = 1.0 if distance + shapes.radii[s] >= 0.0 else -1.0
            normal *= sign / length
            _wrist_row(work, normal, work.point_b, 1.0)
            if f >= 0:
                _finger_row(chains, work, f, shapes.link[s], work.point_a, normal, 1.0)
            cost += _add_row(work, distance - wanted, CLEARANCE_WEIGHT)
    return cost


@njit(cache=True, nogil=True)
def _avoid_hand(chains: Chains, shapes: Shapes, task: Task, work: Work) -> float:
    cost = 0.0
    normal = np.empty(3)
    wanted = task.margins[1] + BUFFER_M
    for p in range(shapes.pairs.shape[0]):
        a, b = shapes.pairs[p, 0], shapes.pairs[p, 1]
        if sphere_gap(shapes, a, b, work.shape_centres) > wanted:
            continue
        distance = pair_clearance(
            shapes, a, b, work.shape_rotations, work.shape_centres, work.point_a, work.point_b
        )
        if distance >= wanted:
            continue
        length = 0.0
        for i in range(3):
            normal[i] = work.point_a[i] - work.point_b[i]
            length += normal[i] ** 2
        if length < 1e-16:
            for i in range(3):
                normal[i] = work.shape_centres[a, i] - work.shape_centres[b, i]
                length += normal[i] ** 2
        normal /= math.sqrt(length) + 1e-12
        if shapes.finger[a] >= 0:
            _finger_row(chains, work, shapes.finger[a], shapes.link[a], work.point_a, normal, 1.0)
        if shapes.finger[b] >= 0:
            _finger_row(chains, work, shapes.finger[b], shapes.link[b], work.point_b, normal, -1.0)
        cost += _add_row(work, distance - wanted, CLEARANCE_WEIGHT)
    return cost


@njit(cache=True, nogil=True)
def _cholesky_step(work: Work, frozen: BoolArray, damping: float) -> bool:
    """Solve (H + damping diag) step = gradient, frozen entries zero; False if not positive definite."""
    h, size = work.hessian.copy(), work.gradient.size
    step = work.step
    for i in range(size):
        step[i] = 0.0 if frozen[i] else work.gradient[i]
        h[i, i] += damping * (h[i, i] + 1.0)
        if frozen[i]:
            h[i, :i] = 0.0
            h[i:, i] = 0.0
            h[i, i] = 1.0
    for i in range(size):
        for j in range(i + 1):
            total = h[i, j]
            for m in range(j):
                total -= h[i, m] * h[j, m]
            if i == j:
                if total <= 0.0:
                    return False
                h[i, i] = math.sqrt(total)
            else:
                h[i, j] = total / h[j, j]
    for i in range(size):
        for m in range(i):
            step[i] -= h[i, m] * step[m]
        step[i] /= h[i, i]
    for i in range(size - 1, -1, -1):
        for m in range(i + 1, size):
            step[i] -= h[m, i] * step[m]
        step[i] /= h[i, i]
    return True


@njit(cache=True, nogil=True)
def _move(
    chains: Chains, rotation: FloatArray, translation: FloatArray, joints: FloatArray, step: FloatArray
) -> None:
    """Apply a step: a twist in the palm frame, and joints kept within their limits."""
    n, k = joints.shape
    x, y, z = step[3], step[4], step[5]
    angle = math.sqrt(x * x + y * y + z * z)
    scale = min(1.0, 0.5 / angle) if angle > 0.0 else 1.0
    for i in range(3):
        translation[i] += rotation[i, 0] * step[0] + rotation[i, 1] * step[1] + rotation[i, 2] * step[2]
    if angle > 1e-12:
        x, y, z = x / angle, y / angle, z / angle
        c, s = math.cos(scale * angle), math.sin(scale * angle)
        u = 1.0 - c
        for i in range(3):
            a, b, d = rotation[i, 0], rotation[i, 1], rotation[i, 2]
            rotation[i, 0] = a * (c + u * x * x) + b * (u * x * y + s * z) + d * (u * x * z - s * y)
            rotation[i, 1] = a * (u * x * y - s * z) + b * (c + u * y * y) + d * (u * y * z + s * x)
            rotation[i, 2] = a * (u * x * z + s * y) + b * (u * y * z - s * x) + d * (c + u * z * z)
    for f in range(n):
        for j in range(chains.counts[f]):
            value = joints[f, j] + min(0.6, max(-0.6, step[6 + f * k + j]))
            joints[f, j] = min(chains.upper[f, j], max(chains.lower[f, j], value))


@njit(cache=True, nogil=True)
def _obstacle_to_palm(task: Task, rotation: FloatArray, translation: FloatArray, work: Work) -> None:
    for i in range(task.obstacle.shape[0]):
        to_palm(rotation, translation, task.obstacle[i], work.obstacle[i])


@njit(cache=True, nogil=True)
def improve(
    chains: Chains, shapes: Shapes, task: Task, contact_of: IntArray, rotation: FloatArray,
    translation: FloatArray, joints: FloatArray, work: Work, avoid: bool, iterations: int,
) -> float:
    """Levenberg-Marquardt on wrist pose and joints, in place.

    Args:
        chains: The fingers.
        shapes: The collision shapes.
        task: What to reach and to avoid.
        contact_of: Contact of each finger, -1 for none, shape (f,).
        rotation: Palm orientation in the world, shape (3, 3).
        translation: Palm origin in the world, shape (3,).
        joints: Joints by finger, shape (f, k).
        work: Work space.
        avoid: Whether clearances count.
        iterations: Most iterations to do.

    Returns:
        The cost reached.
    """
    n, k = joints.shape
    frozen = np.zeros(6 + n * k, dtype=np.bool_)
    old_rotation, old_translation, old_joints = rotation.copy(), translation.copy(), joints.copy()
    if avoid:
        _obstacle_to_palm(task, rotation, translation, work)
    cost = _assemble(chains, shapes, task, contact_of, rotation, translation, joints, work, avoid)
    damping = 1e-4
    for _ in range(iterations):
        for f in range(n):
            for j in range(k):
                i = 6 + f * k + j
                used = contact_of[f] >= 0 and j < chains.counts[f]
                low = used and joints[f, j] <= chains.lower[f, j] and work.gradient[i] < 0.0
                high = used and joints[f, j] >= chains.upper[f, j] and work.gradient[i] > 0.0
                frozen[i] = not used or low or high
        if not _cholesky_step(work, frozen, damping):
            damping *= 10.0
            continue
        old_rotation[:], old_translation[:], old_joints[:] = rotation, translation, joints
        _move(chains, rotation, translation, joints, work.step)
        if avoid:
            _obstacle_to_palm(task, rotation, translation, work)
        trial = _assemble(chains, shapes, task, contact_of, rotation, translation, joints, work, avoid)
        if trial < cost:
            done = trial > 0.995 * cost
            cost = trial
            damping = max(damping * 0.2, 1e-7)
            if done:
                break
        else:
            rotation[:], translation[:], joints[:] = old_rotation, old_translation, old_joints
            damping *= 10.0
            if damping > 1e4:
                break
            if avoid:
                _obstacle_to_palm(task, rotation, translation, work)
            _assemble(chains, shapes, task, contact_of, rotation, translation, joints, work, avoid)
    return cost


@njit(cache=True, nogil=True)
def measure(
    chains: Chains, shapes: Shapes, task: Task, contact_of: IntArray, rotation: FloatArray,
    translation: FloatArray, joints: FloatArray, work: Work, out: FloatArray,
) -> None:
    """Bring every tip exactly to its target with the wrist at rest, then measure the posture.

    Args:
        chains: The fingers.
        shapes: The collision shapes.
        task: What to reach and to avoid.
        contact_of: Contact of each finger, -1 for none, shape (f,).
        rotation: Palm orientation in the world, shape (3, 3).
        translation: Palm origin in the world, shape (3,).
        joints: Joints by finger, changed in place, shape (f, k).
        work: Work space.
        out: Output: tip error, joint margin, smallest singular value, clearances to ground, hand and
            object, shape (6,). Clearances are capped; the object's counts the tangent planes as well.
    """
    target, normal = np.empty(3), np.empty(3)
    out[0], out[1], out[2] = 0.0, 0.5, np.inf
    for f in range(chains.counts.size):
        if contact_of[f] < 0:
            continue
        to_palm(rotation, translation, task.targets[contact_of[f]], target)
        error = kinematics.finger_ik(
            chains, f, target, joints[f], work.rotations[f], work.origins[f], work.jacobian, 0.0
        )
        out[0] = max(out[0], error)
        out[1] = min(out[1], kinematics.joint_margin(chains, f, joints[f]))
        out[2] = min(out[2], kinematics.smallest_singular_value(work.jacobian))
    place_hand(
        chains, shapes, joints, work.rotations, work.origins, work.tips, work.shape_rotations, work.shape_centres
    )
    out[3] = CLEARANCE_CAP_M
    if task.ground_height > -np.inf:
        normal[:] = rotation[2]
        out[3] = ground_clearance(
            shapes, work.shape_rotations, work.shape_centres, normal, task.ground_height - translation[2],
            -1, CLEARANCE_CAP_M,
        )  # fmt: skip
    out[4] = hand_clearance(shapes, work.shape_rotations, work.shape_centres, -1, CLEARANCE_CAP_M)
    out[5] = CLEARANCE_CAP_M
    _obstacle_to_palm(task, rotation, translation, work)
    for s in range(shapes.finger.size):
        if shapes.is_tip[s]:
            continue
        f = shapes.finger[s]
        radius = 0.0
        if f >= 0 and contact_of[f] >= 0 and shapes.link[s] == chains.counts[f] - 1:
            radius = task.exempt_radius
            to_palm(rotation, translation, task.points[contact_of[f]], work.exempt)
            _turn(rotation, task.normals[contact_of[f]], normal)
            offset = normal[0] * work.exempt[0] + normal[1] * work.exempt[1] + normal[2] * work.exempt[2]
            # Touching the tangent plane is allowed, so the margin is added to this distance.
            distance = plane_clearance(
                shapes, s, work.shape_rotations, work.shape_centres, normal, offset, work.point_a
            )
            out[5] = min(out[5], distance + task.margins[2])
        out[5] = min(
            out[5],
            object_clearance(
                shapes, s, work.shape_rotations, work.shape_centres, work.obstacle, work.exempt, radius,
                out[5], work.point_a, work.point_b,
            ),
        )  # fmt: skip
