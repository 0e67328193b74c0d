"""Fingers as plain arrays, extracted from a Pinocchio model for compiled kinematics."""

from typing import NamedTuple

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import HandError
from graspbench.hand.parameters import FingerDescription

LOWER, UPPER, PREFERRED = 0, 1, 2
FEWEST_JOINTS = 3


class Chains(NamedTuple):
    """Serial chains of revolute joints, one for each finger, padded to the longest.

    Every joint frame is turned so that its joint axis is z; the rotation about z follows the fixed
    placement in the frame of the joint before it (of the palm, for the first). Few arrays, because every
    array passed costs compilation time.

    Attributes:
        counts: Number of joints of each finger, shape (f,).
        index: Positions of the joints in the hand's joint vector, shape (f, k).
        fixed: Fixed placements of the joint frames, rotation and origin side by side, shape (f, k, 3, 4).
        tips: Tip centres in the last joint frames, shape (f, 3), m.
        limits: Lower limit, upper limit and preferred position of the joints, shape (f, k, 3), rad.
    """

    counts: IntArray
    index: IntArray  # type: ignore[assignment]  # hides tuple.index, which nobody needs
    fixed: FloatArray
    tips: FloatArray
    limits: FloatArray


def extract_chains(
    model: pinocchio.Model,
    palm: pinocchio.SE3,
    fingers: tuple[FingerDescription, ...],
    hand: str,
) -> tuple[Chains, dict[int, tuple[int, int, pinocchio.SE3]]]:
    """Read the fingers' chains out of a fixed-base model.

    Args:
        model: The hand's model.
        palm: Pose of the palm frame in the model's base.
        fingers: The fingers, tips and joints named as in the model.
        hand: Name of the hand, for error messages.

    Returns:
        The chains, and for every Pinocchio joint on them (finger, position, the joint's frame seen from
        the chain's frame of that joint).

    Raises:
        HandError: A name is unknown, a joint is not revolute, a finger has fewer than three joints, or two
            fingers share a joint.
    """
    joints = [_finger_joints(model, finger, hand) for finger in fingers]
    count = max(len(chain) for chain in joints)
    shape = (len(fingers), count)
    chains = Chains(
        counts=np.array([len(chain) for chain in joints], dtype=np.int64),
        index=np.zeros(shape, dtype=np.int64),
        fixed=np.tile(np.eye(3, 4), (*shape, 1, 1)),
        tips=np.zeros((len(fingers), 3)),
        limits=np.zeros((*shape, 3)),
    )
    frames: dict[int, tuple[int, int, pinocchio.SE3]] = {}
    for f, (finger, chain) in enumerate(zip(fingers, joints, strict=True)):
        before = palm.inverse()
        for k, joint in enumerate(chain):
            if joint in frames:
                raise HandError(
                    f"fingers '{fingers[frames[joint][0]].name}' and '{finger.name}' of hand '{hand}' share "
                    f"the joint '{model.names[joint]}'",
                    remedy="describe fingers whose joints are their own",
                )
            turn = pinocchio.SE3(_align_z(_axis(model, joint, hand)), np.zeros(3))
            placement = before * model.jointPlacements[joint] * turn
            i = model.joints[joint].idx_q
            chains.fixed[f, k] = placement.homogeneous[:3]
            chains.limits[f, k, LOWER] = model.lowerPositionLimit[i]
            chains.limits[f, k, UPPER] = model.upperPositionLimit[i]
            chains.index[f, k] = i
            frames[joint] = (f, k, turn.inverse())
            before = turn.inverse()
        tip = model.frames[_frame(model, finger.tip, hand)].placement
        chains.tips[f] = (before * tip).translation
        limits = chains.limits[f, : len(chain)]
        limits[:, PREFERRED] = _preferred(finger, limits[:, LOWER], limits[:, UPPER], hand)
    return chains, frames


def _finger_joints(model: pinocchio.Model, finger: FingerDescription, hand: str) -> list[int]:
    frame = model.frames[_frame(model, finger.tip, hand)]
    support = [j for j in model.supports[frame.parentJoint] if j != 0]
    if not support:
        raise HandError(
            f"no joint moves the tip '{finger.tip}' of finger '{finger.name}' of hand '{hand}'",
            remedy="name a tip link at the end of a finger",
        )
    if len(support) < FEWEST_JOINTS:
        raise HandError(
            f"finger '{finger.name}' of hand '{hand}' has {len(support)} joints, too few to place its tip",
            remedy=f"describe fingers of {FEWEST_JOINTS} or more revolute joints",
        )
    names = tuple(model.names[j] for j in support)
    if finger.joints is not None and finger.joints != names:
        raise HandError(
            f"finger '{finger.name}' of hand '{hand}' lists the joints {', '.join(finger.joints)}, but its "
            f"tip '{finger.tip}' is moved by {', '.join(names)}",
            remedy="list these, from palm to tip, or leave the list out",
        )
    return support


def _frame(model: pinocchio.Model, name: str, hand: str) -> int:
    if not model.existFrame(name):
        known = ", ".join(f.name for f in model.frames if f.type == pinocchio.FrameType.BODY)
        raise HandError(f"hand '{hand}' has no link '{name}'", remedy=f"choose one of {known}", link=name)
    return int(model.getFrameId(name))


def _axis(model: pinocchio.Model, joint: int, hand: str) -> FloatArray:
    kind = model.joints[joint]
    name = kind.shortname()
    if name in ("JointModelRX", "JointModelRY", "JointModelRZ"):
        return np.asarray(np.eye(3)["XYZ".index(name[-1])])
    if name == "JointModelRevoluteUnaligned":
        return np.asarray(kind.extract().axis, dtype=float)
    raise HandError(
        f"joint '{model.names[joint]}' of hand '{hand}' is not a revolute joint with limits",
        remedy="fingers are chains of revolute joints; make the joint revolute with limits, or fixed",
        joint=model.names[joint],
        type=name,
    )


def _align_z(axis: FloatArray) -> FloatArray:
    """Return a rotation whose third column is the unit vector along ``axis``."""
    z = axis / np.linalg.norm(axis)
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _preferred(finger: FingerDescription, lower: FloatArray, upper: FloatArray, hand: str) -> FloatArray:
    if not np.all(lower < upper):
        raise HandError(
            f"a joint of finger '{finger.name}' of hand '{hand}' has no range (lower limit not below upper)",
            remedy="give the joint limits in the URDF",
        )
    if finger.posture_deg is None:
        return np.asarray((lower + upper) / 2)
    posture = np.radians(finger.posture_deg)
    if posture.shape != lower.shape or np.any(posture <= lower) or np.any(posture >= upper):
        raise HandError(
            f"the posture of finger '{finger.name}' of hand '{hand}' does not lie within the limits of its "
            f"{lower.size} joints",
            remedy="give one angle in degrees for each joint, inside its limits",
            lower_deg=np.degrees(lower).round(2).tolist(),
            upper_deg=np.degrees(upper).round(2).tolist(),
        )
    return np.asarray(posture)
