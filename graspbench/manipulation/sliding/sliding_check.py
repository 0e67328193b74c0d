"""An independent check of contacts that slide with friction: from joints, contact points and forces alone.

How the tips slide comes from Pinocchio's kinematics by differences over time; the recorded forces are put
into the equations of balance, of Coulomb's law and of maximum dissipation.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.hand import HandModel
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.manipulation_result import ManipulationResult
from graspbench.manipulation.tip_tracking import slid_m, tip_poses
from graspbench.manipulation.violations import beyond

POSITION_TOLERANCE_M = 1e-4
"""How far a tip may be off its contact, and how far a contact that sticks may slide in all."""
ANGLE_TOLERANCE_DEG = 1.0
"""Between friction and slip, of which the differences over time are no exact figure."""
SURFACE_TOLERANCE = 1e-4
"""How far friction may be off the limit surface, over the largest friction; normals turn with the path."""
BALANCE_TOLERANCE = 1e-4
"""Wrench that may be missing, N and N m: what forces do about an object that is a little off its path."""
_MIN_SPEED_M_S = 1e-4
"""Where a tip slides more slowly, the direction is not looked at."""


@dataclass(frozen=True)
class SlidingCheck:
    """What the check found.

    Attributes:
        slid_max_m: Longest way that a tip slides over the object in all, of those that are to.
        stuck_slip_max_m: Longest way of those that are not.
        tip_error_max_m: Largest distance of a tip from its contact.
        friction_angle_max_deg: Largest angle between the friction of a sliding contact on the object and
            the way that the tip slides, in coordinates that make the limit surface a sphere.
        surface_error_max: Largest distance of that friction from the limit surface, over the largest one.
        reserve_min: Smallest share of its friction that a contact keeps that does not slide.
        balance_error_max: Largest wrench missing to the load, N or N m.
        violations: What is violated, one clause each; empty when all is well.
    """

    slid_max_m: float
    stuck_slip_max_m: float
    tip_error_max_m: float
    friction_angle_max_deg: float
    surface_error_max: float
    reserve_min: float
    balance_error_max: float
    violations: tuple[str, ...]


def check_sliding(
    hand: HandModel, result: ManipulationResult, contact: ContactParameters, *, gravity: float = 9.81
) -> SlidingCheck:
    """Check contacts that slide; nothing of what planned their motion is used.

    Args:
        hand: The hand.
        result: The motion.
        contact: Contact type and forces.
        gravity: m/s^2.

    Raises:
        ManipulationError: No contact of the motion slides on purpose.
    """
    planned = result.sliding
    if planned is None:
        raise ManipulationError("no contact of the motion slides", remedy="set contact.sliding.fingers")
    poses = result.desired_transforms_object_to_palm
    tips, rotations = tip_poses(hand, planned.fingers, result.history.joints)
    centres = result.contact_points + hand.tip_radius_m * result.contact_normals
    touching = np.einsum("tij,tnj->tni", poses[:, :3, :3], centres) + poses[:, None, :3, 3]
    n_c = tips.shape[1]
    slid = np.stack(
        [slid_m(result.contact_points[:, i], tips[:, i], rotations[:, i], poses) for i in range(n_c)], axis=1
    )
    ways = np.linalg.norm(slid, axis=2).sum(axis=0)
    sliding = list(planned.contacts)
    others = [i for i in range(n_c) if i not in sliding]
    if contact.kind != "rolling":  # a tip that turns on the spot does not roll
        moved = result.contact_points[:, others] - result.contact_points[:1, others]
        ways[others] = np.linalg.norm(moved, axis=2).max(axis=0)
    turned = _turned(rotations, poses)
    friction = [_at(result, contact, slid, turned, k) for k in range(len(result.force_times))]
    balance = max(_missing(result, contact, gravity, k) for k in range(len(result.force_times)))
    angle = max(each.angle_deg for each in friction)
    surface = max(each.surface_error for each in friction)
    reserve = min(each.reserve for each in friction)
    tip_error = float(np.linalg.norm(tips - touching, axis=2).max())
    stuck = float(ways[others].max())
    wanted = contact.sliding.friction_reserve
    violations = [
        *beyond("a tip is {:.3g} mm off its contact", 1e3 * tip_error, 1e3 * POSITION_TOLERANCE_M),
        *beyond("a contact that sticks slides {:.3g} mm", 1e3 * stuck, 1e3 * POSITION_TOLERANCE_M),
        *beyond("friction is {:.3g} deg off the way of sliding", angle, ANGLE_TOLERANCE_DEG),
        *beyond("friction is {:.3g} off the limit surface", surface, SURFACE_TOLERANCE),
        *beyond("a contact lacks {:.3g} of the friction it is to keep", wanted - reserve, SURFACE_TOLERANCE),
        *beyond("forces miss the load by {:.3g}", balance, BALANCE_TOLERANCE),
    ]
    slid_most = float(ways[sliding].max())
    return SlidingCheck(
        slid_most, stuck, tip_error, angle, surface, reserve, balance, tuple(dict.fromkeys(violations))
    )


def _turned(rotations: FloatArray, poses: FloatArray) -> FloatArray:
    """Return how tips turn against the object from sample to sample, palm frame, (t - 1, n_c, 3), rad."""
    out = np.empty((len(rotations) - 1, rotations.shape[1], 3))
    by_object = poses[1:, :3, :3] @ poses[:-1, :3, :3].transpose(0, 2, 1)
    for i in range(rotations.shape[1]):
        by_tip = rotations[1:, i] @ rotations[:-1, i].transpose(0, 2, 1)
        out[:, i] = Rotation.from_matrix(by_tip @ by_object.transpose(0, 2, 1)).as_rotvec()
    return out


@dataclass(frozen=True)
class _Friction:
    angle_deg: float
    surface_error: float
    reserve: float


def _at(
    result: ManipulationResult,
    contact: ContactParameters,
    slid: FloatArray,
    turned: FloatArray,
    k: int,
) -> _Friction:
    """Return how friction stands to the limit surface at one time of the forces."""
    sample, rotation = _sample(result, k)
    mu, torsion_m = contact.forces.friction, contact.forces.torsion_m if contact.kind == "soft" else 0.0
    period = result.history.times[1] - result.history.times[0]
    around = slice(max(sample - 1, 0), sample + 1)
    speeds, spins = slid[around] / period, turned[around] / period
    assert result.sliding is not None, "the caller has looked"
    angle, error, reserve = 0.0, 0.0, np.inf
    for i, force in enumerate(result.forces[k]):
        normal = rotation @ result.contact_normals[sample, i]
        pressing = -float(force @ normal)
        scaled = (force + pressing * normal) / mu
        if torsion_m > 0.0:
            scaled = np.append(scaled, result.torsions[k, i] / torsion_m)
        used = float(np.linalg.norm(scaled)) / pressing
        if i not in result.sliding.contacts or result.sliding.margins[k, i] != 0.0:
            most = max(float(np.linalg.norm(scaled[:3])), float(np.abs(scaled[3:]).max(initial=0.0)))
            reserve = min(reserve, 1.0 - most / pressing)
            continue
        error = max(error, abs(used - 1.0))
        ways = mu * (speeds[:, i] - np.outer(speeds[:, i] @ normal, normal))
        if np.linalg.norm(ways, axis=1).min() < mu * _MIN_SPEED_M_S:
            continue
        if torsion_m > 0.0:
            ways = np.column_stack([ways, torsion_m * (spins[:, i] @ normal)])
        # the differences leave open how the way bends from before to after
        open_deg = 0.5 * _angle_deg(ways[0], ways[-1])
        angle = max(angle, _angle_deg(scaled, ways.mean(axis=0)) - open_deg)
    return _Friction(angle, error, reserve)


def _angle_deg(a: FloatArray, b: FloatArray) -> float:
    cosine = a @ b / (np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _sample(result: ManipulationResult, k: int) -> tuple[int, FloatArray]:
    """Return the sample of the history at a time of the forces, and the object's orientation there."""
    sample = int(np.argmin(np.abs(result.history.times - result.force_times[k])))
    return sample, result.desired_transforms_object_to_palm[sample, :3, :3]


def _missing(result: ManipulationResult, contact: ContactParameters, gravity: float, k: int) -> float:
    """Return the largest component of the wrench that forces miss; the path's acceleration by differences."""
    sample, rotation = _sample(result, k)
    positions, times = result.desired_transforms_object_to_palm[:, :3, 3], result.history.times
    load = np.array(contact.sliding.wrench)
    up = result.transform_palm_to_world[:3, :3].T @ np.array([0.0, 0.0, gravity])
    acceleration, error = np.zeros(3), 0.0
    if np.ptp(positions, axis=0).max() > 0.0:
        at, period = min(max(sample, 1), len(times) - 2), times[1] - times[0]
        acceleration = (positions[at + 1] - 2.0 * positions[at] + positions[at - 1]) / period**2
        nearby = positions[max(at - 2, 0) : at + 3]
        # what the differences leave out, of third order and more, is bounded by how they differ nearby
        error = float(np.abs(np.diff(nearby, 3, axis=0)).max(initial=0.0)) / period**2
    load[:3] += contact.carried_kg * (up + acceleration)
    forces = result.forces[k]
    points = result.contact_points[sample] @ rotation.T
    normals = result.contact_normals[sample] @ rotation.T
    given = np.append(forces.sum(axis=0), np.cross(points, forces).sum(axis=0) + result.torsions[k] @ normals)
    missing = np.abs(given - load)
    missing[:3] -= contact.carried_kg * error
    return float(max(missing.max(), 0.0))
