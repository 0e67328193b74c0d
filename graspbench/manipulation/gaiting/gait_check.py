"""An independent check of a gait, from its joint positions and contact points alone.

Nothing of what planned the gait is used: Pinocchio's kinematics say where the fingertips are, Coal what
overlaps, and the recorded forces are put into the equations of balance and friction.
"""

from dataclasses import dataclass, replace

import numpy as np
import trimesh

from graspbench.arrays import FloatArray
from graspbench.hand import HandModel, HandPosture
from graspbench.hand.verification import verify_posture
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.gaiting.gait_result import GaitResult
from graspbench.manipulation.tip_tracking import slid_m, tip_poses
from graspbench.manipulation.violations import beyond
from graspbench.reconstruction.surface import Surface

POSITION_TOLERANCE_M = 1e-4
"""How far the object may be off its path, and a tip off its contact."""
ROTATION_TOLERANCE_DEG = 0.1
SLIP_TOLERANCE_M = 1e-4
"""How far a rolling tip may slide in all, between two steps of it."""
_LIMIT_TOLERANCE = 1e-9
_BALANCE_TOLERANCE = 1e-3
"""Wrench that may be missing, over the weight (and times 0.1 m for torques)."""
_CONE_TOLERANCE_N = 1e-6
_MIN_SINGULAR_M = 1e-3
_LOOK_S = 0.1
_NEAR_M = 1e-3
"""A stepping tip may sink into the mesh as far as charts do, so near to its contact."""
_ARM_M = 0.1


@dataclass(frozen=True)
class GaitCheck:
    """What the check found.

    Attributes:
        position_error_max_m: Largest distance of the object, as the tips hold it, from its path.
        rotation_error_max_deg: Largest angle between its orientation and its path's.
        tip_error_max_m: Largest distance of a tip from its contact.
        slip_max_m: Longest way that a tip slides over the surface in one stand; of rolling contacts.
        turned_deg: How far the object, as the tips hold it, has turned in the end.
        joint_margin_min_deg: Smallest distance of a joint to its limit.
        speed_share_max: Largest joint velocity, as share of the joint's limit.
        friction_margin_min_n: Smallest friction left at a contact by the recorded forces.
        violations: What is violated, one clause each; empty when all is well.
    """

    position_error_max_m: float
    rotation_error_max_deg: float
    tip_error_max_m: float
    slip_max_m: float
    turned_deg: float
    joint_margin_min_deg: float
    speed_share_max: float
    friction_margin_min_n: float
    violations: tuple[str, ...]


def check_gait(
    hand: HandModel,
    surface: Surface,
    result: GaitResult,
    contact: ContactParameters,
    *,
    gravity: float = 9.81,
) -> GaitCheck:
    """Check a gait; nothing of what planned it is used.

    Args:
        hand: The hand.
        surface: The object's surface in the world.
        result: The gait.
        contact: Contact type and forces.
        gravity: m/s^2.
    """
    tips, rotations = tip_poses(hand, result.fingers, result.history.joints)
    poses = result.desired_transforms_object_to_palm
    reached, tip_error = _object_poses(hand, result, tips)
    away = np.linalg.norm(reached[:, :3, 3] - poses[:, :3, 3], axis=1)
    turned_off = _angles_deg(reached[:, :3, :3], poses[:, :3, :3])
    slip = _slip_m(result, tips, rotations) if contact.kind == "rolling" else _shift_m(result)
    joints = result.history.joints
    margins = np.rad2deg(np.minimum(joints - hand.lower, hand.upper - joints))
    steps = np.diff(result.history.times)[:, None]
    speeds = np.abs(np.diff(joints, axis=0)) / steps / hand.velocity_limits
    friction, missing = _forces(result, contact, gravity)
    violations = [
        *beyond("the object is {:.3g} mm off its path", 1e3 * away.max(), 1e3 * POSITION_TOLERANCE_M),
        *beyond("the object is turned {:.3g} deg off its path", turned_off.max(), ROTATION_TOLERANCE_DEG),
        *beyond("a tip is {:.3g} mm off its contact", 1e3 * tip_error, 1e3 * POSITION_TOLERANCE_M),
        *beyond("a tip slides {:.3g} mm", 1e3 * slip, 1e3 * SLIP_TOLERANCE_M),
        *beyond("a joint is {:.3g} deg beyond its limit", -margins.min(), np.rad2deg(_LIMIT_TOLERANCE)),
        *beyond("a joint is {:.3g} times as fast as it can", speeds.max(), 1.0 + 1e-6),
        *beyond("forces miss {:.3g} times the weight", missing, _BALANCE_TOLERANCE),
        *beyond("a contact's force is {:.3g} N outside its cone", -friction, _CONE_TOLERANCE_N),
        *_overlaps(hand, surface, result, tips),
    ]
    whole = _turned_deg(reached, result)
    return GaitCheck(
        position_error_max_m=float(away.max()),
        rotation_error_max_deg=float(turned_off.max()),
        tip_error_max_m=float(tip_error),
        slip_max_m=float(slip),
        turned_deg=whole,
        joint_margin_min_deg=float(margins.min()),
        speed_share_max=float(speeds.max()),
        friction_margin_min_n=float(friction),
        violations=tuple(dict.fromkeys(violations)),
    )


def _object_poses(hand: HandModel, result: GaitResult, tips: FloatArray) -> tuple[FloatArray, float]:
    """Return where the object is if its contacts are at the tips, shape (t, 4, 4), and the largest misfit.

    The best rigid motion from the contacts, a tip's radius outside the surface, to the tips (Kabsch 1976).
    Two tips leave a turn about their line open: the object is then taken to be as it was.
    """
    centres = result.contact_points + hand.tip_radius_m * result.contact_normals
    poses = np.tile(np.eye(4), (len(tips), 1, 1))
    misfit = 0.0
    for k, on in enumerate(result.touching):
        if on.sum() < 3:
            poses[k] = poses[k - 1]
        else:
            a, b = centres[k, on], tips[k, on]
            u, _, vt = np.linalg.svd((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))
            poses[k, :3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
            poses[k, :3, 3] = b.mean(axis=0) - poses[k, :3, :3] @ a.mean(axis=0)
        rest = tips[k, on] - centres[k, on] @ poses[k, :3, :3].T - poses[k, :3, 3]
        misfit = max(misfit, float(np.linalg.norm(rest, axis=1).max()))
    return poses, misfit


def _angles_deg(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the angles between orientations, shape (t,); exact where they are small."""
    chords = np.linalg.norm((a - b).reshape(len(a), -1), axis=1) / np.sqrt(8.0)
    angles: FloatArray = np.rad2deg(2.0 * np.arcsin(np.clip(chords, 0.0, 1.0)))
    return angles


def _turned_deg(reached: FloatArray, result: GaitResult) -> float:
    """Return the turn about the axis in the end, added up sample by sample."""
    turns = reached[1:, :3, :3] @ reached[:-1, :3, :3].transpose(0, 2, 1)
    vectors = 0.5 * np.stack(
        (
            turns[:, 2, 1] - turns[:, 1, 2],
            turns[:, 0, 2] - turns[:, 2, 0],
            turns[:, 1, 0] - turns[:, 0, 1],
        ),
        axis=1,
    )
    return float(np.rad2deg(np.arcsin(np.clip(vectors @ result.axis, -1.0, 1.0)).sum()))


def _slip_m(result: GaitResult, tips: FloatArray, rotations: FloatArray) -> float:
    """Return the longest way that the surface of a tip slides over the object's in one stand."""
    poses = result.desired_transforms_object_to_palm
    longest = 0.0
    for i in range(tips.shape[1]):
        on = result.touching[:, i]
        slid = np.linalg.norm(slid_m(result.contact_points[:, i], tips[:, i], rotations[:, i], poses), axis=1)
        total = 0.0
        for k in range(len(slid)):
            total = total + slid[k] if on[k] and on[k + 1] else 0.0
            longest = max(longest, total)
    return longest


def _shift_m(result: GaitResult) -> float:
    """Return how far a contact that does not roll moves over the surface in one stand."""
    longest = 0.0
    for i in range(result.touching.shape[1]):
        start = result.contact_points[0, i]
        for k, on in enumerate(result.touching[:, i]):
            if on and not result.touching[k - 1, i]:
                start = result.contact_points[k, i]
            if on:
                longest = max(longest, float(np.linalg.norm(result.contact_points[k, i] - start)))
    return longest


def _forces(result: GaitResult, contact: ContactParameters, gravity: float) -> tuple[float, float]:
    """Return the least friction left, N, and the largest wrench that is missing, in weights.

    The object only turns about its origin, which is at the centre of its mass.
    """
    friction, torsion_m = contact.forces.friction, contact.forces.torsion_m
    weight_n = contact.carried_kg * gravity
    up = result.transform_palm_to_world[:3, :3].T @ np.array([0.0, 0.0, weight_n])
    least, worst = np.inf, 0.0
    times = result.history.times
    for time, forces, torsions in zip(result.force_times, result.forces, result.torsions, strict=True):
        k = min(int(np.searchsorted(times, time - 1e-9)), len(times) - 1)
        rotation = result.desired_transforms_object_to_palm[k, :3, :3]
        if np.isnan(forces).any():
            return -np.inf, np.inf
        used = np.linalg.norm(forces, axis=1) > 0.0
        points = result.contact_points[k, used] @ rotation.T
        normals = result.contact_normals[k, used] @ rotation.T
        pressing = -np.einsum("ij,ij->i", forces[used], normals)
        sideways = np.linalg.norm(forces[used] + pressing[:, None] * normals, axis=1)
        least = min(least, float((friction * pressing - sideways).min()))
        if contact.kind == "soft":
            least = min(least, float((torsion_m * pressing - np.abs(torsions[used])).min() / _ARM_M))
        elif np.any(torsions != 0.0):
            worst = np.inf
        turning = np.cross(points, forces[used]).sum(axis=0) + torsions[used] @ normals
        missing = np.append(forces.sum(axis=0) - up, turning / _ARM_M)
        worst = max(worst, float(np.linalg.norm(missing)) / weight_n)
    return least, worst


def _overlaps(hand: HandModel, surface: Surface, result: GaitResult, tips: FloatArray) -> list[str]:
    """Return what overlaps at samples of the gait, by Coal; tips on contacts may sink in as charts do."""
    times = result.history.times
    period = float(times[1] - times[0])
    every = max(1, round(_LOOK_S / period))
    world_to_first = np.linalg.inv(result.desired_transforms_object_to_palm[0]) @ np.linalg.inv(
        result.transform_palm_to_world
    )
    margins = replace(hand.margins, singular_value_m=_MIN_SINGULAR_M)
    found = []
    for k in range(0, len(times), every):
        on = result.touching[k]
        pose = result.transform_palm_to_world @ result.desired_transforms_object_to_palm[k]
        move = pose @ world_to_first
        mesh = trimesh.Trimesh(
            surface.points @ move[:3, :3].T + move[:3, 3], surface.network.faces, process=False
        )
        fingers = tuple(f for f, there in zip(result.fingers, on, strict=True) if there)
        posture = HandPosture(
            result.transform_palm_to_world, result.history.joints[k], fingers, 0.0, 0.0, 0.0, 0.0
        )
        points = result.contact_points[k, on] @ pose[:3, :3].T + pose[:3, 3]
        normals = result.contact_normals[k, on] @ pose[:3, :3].T
        clauses = verify_posture(
            hand, posture, points, normals, ground_height_m=None, object_mesh=mesh, margins=margins
        )
        near = [i for i in range(len(on)) if on[i] or _is_near_contact(result, tips, k, i)]
        touching = {hand.tip_links[result.fingers[i]] for i in near}
        found += [c for c in clauses if not _is_contact(c, touching)]
    return found


def _is_near_contact(result: GaitResult, tips: FloatArray, k: int, contact: int) -> bool:
    """Tell whether a stepping tip has hardly left its contact, or is about to reach the next one."""
    stands = np.flatnonzero(result.touching[:, contact])
    after = int(np.searchsorted(stands, k))
    ends = stands[max(after - 1, 0) : after + 1]
    return bool(np.linalg.norm(tips[ends, contact] - tips[k, contact], axis=1).min() < _NEAR_M)


def _is_contact(clause: str, touching: set[str]) -> bool:
    """Tell whether a clause says no more than that a tip that touches meets the surface's mesh."""
    return clause.endswith("in the object") and any(name in clause.split()[0] for name in touching)
