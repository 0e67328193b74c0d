"""A hand closed geometrically: every finger bends until its links meet the object.

As graspers in simulators have done since GraspIt! (Miller and Allen 2004): a joint stops once a link that it
moves touches, and the joints beyond that link go on. Steps are safe ones: no link can meet the object before
its end (conservative advancement, Mirtich 1996).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.evaluation.bodies import HandBodies, Nearness, ObjectBody
from graspbench.evaluation.grasp_record import ContactSet, GraspRecord, HandPose
from graspbench.grasp.internal_forces import internal_forces
from graspbench.hand.model import HandModel

TOUCH_M = 2e-5
"""A link nearer than this touches."""

_MAX_STEPS = 400
_MIN_STEP = 1e-4
_SURE_M = 1e-5
"""Distances are known to less than this."""
_SAME = 1e-9
_DAMPING_M2 = 1e-5
_STEADY_SHARE = 0.2
_LEAST_YIELDING = 1e-9


@dataclass(frozen=True, eq=False)
class ClosedHand:
    """A hand after it closed.

    Attributes:
        joints: Where its joints came, shape (n_q,).
        contacts: Where links touch the object, one a link.
        fingers: Finger of each contact, -1 for the palm, shape (m,).
        links: Position of the touching link's joint in its finger's chain, -1 for the palm, shape (m,).
    """

    joints: FloatArray
    contacts: ContactSet
    fingers: IntArray
    links: IntArray


def close_hand(
    bodies: HandBodies,
    body: ObjectBody,
    palm: FloatArray,
    way: Sequence[FloatArray],
    palm_touch_m: float = 5e-4,
) -> ClosedHand:
    """Close all fingers along a way of joints until they touch.

    Args:
        bodies: The hand.
        body: The object.
        palm: transform_palm_to_object, shape (4, 4); it does not move.
        way: Joints from open to squeezed, at least two rows of shape (n_q,).
        palm_touch_m: The palm touches when it is as near as this.
    """
    rows = np.asarray(way, dtype=np.float64)
    joints = rows[-1].copy()
    found: list[tuple[int, int, Nearness]] = []
    for group in _independent(bodies.hand):
        found += _close_group(bodies, body, palm, rows, joints, group)
    nears = nearest_of(bodies, body, palm, joints, np.flatnonzero(bodies.links[:, 0] < 0), palm_touch_m)
    if nears:
        found.append((-1, -1, nears[0]))
    return ClosedHand(
        joints=joints,
        contacts=ContactSet(
            np.array([near.point for _, _, near in found]).reshape(-1, 3),
            np.array([near.normal for _, _, near in found]).reshape(-1, 3),
        ),
        fingers=np.array([finger for finger, _, _ in found], dtype=np.int64),
        links=np.array([link for _, link, _ in found], dtype=np.int64),
    )


def squeezed_joints(
    bodies: HandBodies,
    closed: ClosedHand,
    palm: FloatArray,
    grip_force_n: float,
    stiffness_nm_rad: float,
    friction: float,
) -> FloatArray:
    """Return where joints that are springs have to be sent to grip, within their limits, shape (n_q,).

    The contacts press with forces that balance each other, as far as friction lets them.

    Args:
        bodies: The hand.
        closed: The hand as it closed.
        palm: transform_palm_to_object, shape (4, 4).
        grip_force_n: Mean normal force of a contact, up to what the springs keep steady.
        stiffness_nm_rad: Of the joints.
        friction: Coulomb friction at the contacts.
    """
    points, normals = closed.contacts.points, closed.contacts.normals
    if len(points) < 2:
        return closed.joints.copy()
    jacobians = np.stack(
        [
            bodies.point_jacobian(palm, closed.joints, int(finger), int(link), point)
            for finger, link, point in zip(closed.fingers, closed.links, points, strict=True)
        ]
    )
    # Opposing forces F at a distance r act on a turn of the object like a spring of stiffness -F r, and the
    # fingers' springs must outdo it (Cutkosky and Kao 1989): else the object rolls out of the grip.
    radius = float(np.linalg.norm(points - points.mean(axis=0), axis=1).min())
    yielding = np.linalg.norm(jacobians, 2, axis=(1, 2)) ** 2 / stiffness_nm_rad
    steady_n = _STEADY_SHARE * radius / max(float(yielding.max()), _LEAST_YIELDING)
    grip_n = min(grip_force_n, steady_n)
    forces, left = internal_forces(points, -normals, friction, grip_n)
    if left < 0.0:  # nothing balances: press all alike
        forces = -grip_n * normals
    torques = np.einsum("mij,mi->j", jacobians, forces)
    joints = closed.joints + torques / stiffness_nm_rad
    return np.asarray(np.clip(joints, bodies.hand.lower, bodies.hand.upper))


def nearest_of(
    bodies: HandBodies,
    body: ObjectBody,
    palm: FloatArray,
    joints: FloatArray,
    shapes: IntArray,
    enough_m: float = np.inf,
) -> list[Nearness]:
    """Return how near some shapes of a placed hand are, the nearest first, as far as ``enough_m``."""
    which = [int(shape) for shape in shapes]
    placed = bodies.place(palm, joints, which)
    gaps = body.gaps(bodies.balls(which, placed))
    nears = [
        body.nearness(bodies.shapes[shape], pose, row, enough_m)[0]
        for shape, pose, row in zip(which, placed, gaps, strict=True)
    ]
    return sorted((near for near in nears if near is not None), key=lambda near: near.distance_m)


def closing_way(
    record: GraspRecord,
    bodies: HandBodies,
    body: ObjectBody,
    opening_m: float,
    squeezing_m: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the joints open, at the grasp and squeezed, shape (n_q,) each.

    What the record does not state, or states as the grasp itself, is made up: tips are opened away from the
    object, and closed into it, as far as the joints' limits let them.

    Args:
        record: A grasp with a hand.
        bodies: The hand.
        body: The object.
        opening_m: How far the tips are opened.
        squeezing_m: How far they are squeezed in.
    """
    grasp = record.grasp
    assert grasp is not None, "the caller has looked"
    opened = record.pregrasp.joints if record.pregrasp and is_stated(record.pregrasp, grasp) else None
    squeezed = record.squeeze.joints if record.squeeze and is_stated(record.squeeze, grasp) else None
    if opened is None or squeezed is None:
        outwards = _outwards(bodies, body, grasp)
        if opened is None:
            opened = _moved(bodies.hand, grasp.joints, opening_m * outwards)
        if squeezed is None:
            squeezed = _moved(bodies.hand, grasp.joints, -squeezing_m * outwards)
    return opened, grasp.joints, squeezed


def is_stated(stage: HandPose | None, grasp: HandPose) -> bool:
    """Tell whether a stage is there and is not the grasp itself, as files have it that know no other."""
    return stage is not None and bool(np.abs(stage.joints - grasp.joints).max(initial=0.0) >= _SAME)


def _outwards(bodies: HandBodies, body: ObjectBody, grasp: HandPose) -> FloatArray:
    """Return the object's outward normal nearest to each tip, palm frame, shape (n_f, 3)."""
    hand = bodies.hand
    normals = np.zeros((hand.n_fingers, 3))
    for finger in range(hand.n_fingers):
        last = int(hand.chains.counts[finger]) - 1
        shapes = np.flatnonzero((bodies.links[:, 0] == finger) & (bodies.links[:, 1] == last))
        nears = nearest_of(bodies, body, grasp.transform_palm_to_object, grasp.joints, shapes)
        if nears:
            normals[finger] = grasp.transform_palm_to_object[:3, :3].T @ nears[0].normal
    return normals


def _moved(hand: HandModel, joints: FloatArray, ways: FloatArray) -> FloatArray:
    """Return joints that move the tips by some ways, shape (n_f, 3), m, along each way's own direction."""
    jacobians = hand.tip_jacobians(joints)
    lengths = np.linalg.norm(ways, axis=1)
    used = lengths > 0.0
    if not np.any(used):
        return joints.copy()
    rows = np.einsum("fi,fij->fj", ways[used] / lengths[used, None], jacobians[used])
    gram = rows @ rows.T + _DAMPING_M2 * np.eye(len(rows))
    step = rows.T @ np.linalg.solve(gram, lengths[used])
    return np.asarray(np.clip(joints + step, hand.lower, hand.upper))


def _independent(hand: HandModel) -> list[list[int]]:
    """Return the fingers in groups that share joints."""
    groups: list[tuple[set[int], list[int]]] = []
    for finger in range(hand.n_fingers):
        moved, members = set(hand.finger_joints(finger).tolist()), [finger]
        apart = []
        for joints, others in groups:
            if joints & moved:
                moved |= joints
                members = others + members
            else:
                apart.append((joints, others))
        groups = [*apart, (moved, members)]
    return [members for _, members in groups]


def _close_group(
    bodies: HandBodies,
    body: ObjectBody,
    palm: FloatArray,
    rows: FloatArray,
    joints: FloatArray,
    group: list[int],
) -> list[tuple[int, int, Nearness]]:
    """Close some fingers; write where their joints come, and return finger, link and place of each touch."""
    hand = bodies.hand
    moving = np.zeros(hand.n_joints, dtype=np.bool_)
    for finger in group:
        moving[hand.finger_joints(finger)] = True
    joints[moving] = rows[0, moving]
    watched = [int(s) for s in np.flatnonzero(np.isin(bodies.links[:, 0], group))]
    levers = bodies.levers
    links = [(int(finger), int(link)) for finger, link in bodies.links]
    touched: dict[tuple[int, int], Nearness] = {}
    free = np.zeros(len(levers))  # no shape is nearer to the object than this
    along, last = 0.0, float(len(rows) - 1)
    for _ in range(_MAX_STEPS):
        segment = min(int(along), len(rows) - 2)
        slopes = np.where(moving, np.abs(rows[segment + 1] - rows[segment]), 0.0)
        speeds = (levers @ slopes).tolist()
        step, stopped = segment + 1.0 - along, False
        # What cannot touch within the step, as far as it is known to be away, need not be looked at.
        reach = [step * speed + TOUCH_M + _SURE_M for speed in speeds]
        due = [s for s in watched if free[s] <= reach[s] and links[s] not in touched]
        placed = bodies.place(palm, joints, due)
        gaps = body.gaps(bodies.balls(due, placed))
        for shape, pose, row in zip(due, placed, gaps, strict=True):
            finger, link = links[shape]
            if (finger, link) in touched:  # by another shape of the link
                continue
            speed = speeds[shape]
            enough = step * speed + TOUCH_M
            near, free[shape] = body.nearness(bodies.shapes[shape], pose, row, enough)
            if near is None:
                continue
            if near.distance_m <= TOUCH_M:
                touched[finger, link] = near
                moving[hand.chains.index[finger, : link + 1]] = False
                stopped = True
            else:
                step = min(step, near.distance_m / speed)
        if stopped:
            watched = [shape for shape in watched if np.any(moving & (levers[shape] > 0.0))]
        if not watched or (along >= last and not stopped):
            break
        if not stopped:
            along = min(along + max(step, _MIN_STEP), segment + 1.0)
            share = along - segment
            moved = ((1.0 - share) * rows[segment] + share * rows[segment + 1])[moving]
            free -= levers[:, moving] @ np.abs(moved - joints[moving])
            joints[moving] = moved
    return [(finger, link, near) for (finger, link), near in sorted(touched.items(), key=lambda t: t[0])]
