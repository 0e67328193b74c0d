"""Fingers as plain arrays, extracted from a Pinocchio model for compiled kinematics.

A joint that follows another (URDF: mimic) has its own frame but no freedom of its own: its position is
ratio * leader + offset, and a leader may be in another finger, as in a parallel gripper.
"""

from typing import NamedTuple

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import HandError
from graspbench.hand.parameters import FingerDescription

LOWER, UPPER, PREFERRED, RATIO, OFFSET, VECTOR_RATIO, VECTOR_OFFSET = 0, 1, 2, 3, 4, 5, 6
SLIDES, LEADER_FINGER, LEADER = 0, 1, 2
DISC, ROUND, ELEMENT = 6, 7, 8
_NUDGE, _AXIS_TOLERANCE = 0.5, 1e-6


class Chains(NamedTuple):
    """Serial chains of revolute or prismatic joints, one for each finger, padded to the longest.

    Every joint frame is turned so that its joint axis is z; the rotation about z, or the slide along it,
    follows the fixed placement in the frame of the joint before it (of the palm, for the first). Few arrays,
    because every array passed costs compilation time.

    Attributes:
        counts: Number of joints of each finger, shape (f,).
        index: Positions in the hand's joint vector, of the leader for a joint that follows, shape (f, k).
        kinds: Whether the joint slides (1) or turns (0), finger and position of its leader: itself for one
            that follows none; shape (f, k, 3).
        fixed: Fixed placements of the joint frames, rotation and origin side by side, shape (f, k, 3, 4).
        tips: Tip centres in the last joint frames, shape (f, 3), m.
        limits: Lower limit, upper limit and preferred position of the joints, rad or m; ratio and offset to
            the leader (1 and 0 for itself), then to the entry of the joint vector; shape (f, k, 7).
        elements: What tips of the links' real shapes are hulls of, in the last joint frames: a centre, the
            axis of a disc around it, the disc's radius, and the radius of the ball it is swept by; none for
            spherical tips; shape (e, 8), m.
        spans: First element of each finger and the one after its last, shape (f, 2).
        pads: Directions that tips of real shapes touch in, in the last joint frames, shape (f, 3).
    """

    counts: IntArray
    index: IntArray  # type: ignore[assignment]  # hides tuple.index, which nobody needs
    kinds: IntArray
    fixed: FloatArray
    tips: FloatArray
    limits: FloatArray
    elements: FloatArray
    spans: IntArray
    pads: FloatArray


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
        HandError: A name is unknown, a joint neither turns nor slides, a tip has no joint, or two fingers
            share a joint.
    """
    joints = [_finger_joints(model, finger, hand) for finger in fingers]
    count = max(len(chain) for chain in joints)
    shape = (len(fingers), count)
    chains = Chains(
        counts=np.array([len(chain) for chain in joints], dtype=np.int64),
        index=np.zeros(shape, dtype=np.int64),
        kinds=np.zeros((*shape, 3), dtype=np.int64),
        fixed=np.tile(np.eye(3, 4), (*shape, 1, 1)),
        tips=np.zeros((len(fingers), 3)),
        limits=np.zeros((*shape, 7)),
        elements=np.zeros((0, ELEMENT)),
        spans=np.zeros((len(fingers), 2), dtype=np.int64),
        pads=np.zeros((len(fingers), 3)),
    )
    chains.kinds[..., LEADER_FINGER], chains.kinds[..., LEADER] = np.indices(shape)
    chains.limits[..., RATIO] = chains.limits[..., VECTOR_RATIO] = 1.0
    leaders = _leaders(model, joints)
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
            slides, axis = motion_axis(model, joint, hand)
            turn = pinocchio.SE3(align_z(axis), np.zeros(3))
            placement = before * model.jointPlacements[joint] * turn
            i = model.joints[joint].idx_q
            ratio, offset = coupling(model, joint)
            chains.fixed[f, k] = placement.homogeneous[:3]
            range_ = np.array([model.lowerPositionLimit[i], model.upperPositionLimit[i]])
            ends = sorted(ratio * range_ + offset)
            chains.limits[f, k] = (*ends, 0.0, 1.0, 0.0, ratio, offset)
            chains.index[f, k] = i
            chains.kinds[f, k] = (slides, *leaders[i])
            frames[joint] = (f, k, turn.inverse())
            before = turn.inverse()
        tip = model.frames[_frame(model, finger.tip, hand)].placement
        chains.tips[f] = (before * tip).translation
        limits = chains.limits[f, : len(chain)]
        limits[:, PREFERRED] = _preferred(finger, limits, chains.kinds[f, : len(chain)], (f, hand))
    _follow_leaders(chains)
    return chains, frames


def coupling(model: pinocchio.Model, joint: int) -> tuple[float, float]:
    """Return ratio and offset of a joint to the one that it follows; 1 and 0 for one that follows none."""
    if model.joints[joint].shortname() != "JointModelMimic":
        return 1.0, 0.0
    follower = model.joints[joint].extract()
    return float(follower.scaling), float(follower.offset)


def _leaders(model: pinocchio.Model, joints: list[list[int]]) -> dict[int, tuple[int, int]]:
    """Return finger and position of the joint that stands for each entry of the joint vector.

    It is the joint itself where a finger has it, else the first that follows it.
    """
    found: dict[int, tuple[int, int]] = {}
    for followers in (False, True):
        for f, chain in enumerate(joints):
            for k, joint in enumerate(chain):
                if (model.joints[joint].nq == 0) == followers:
                    found.setdefault(int(model.joints[joint].idx_q), (f, k))
    return found


def _follow_leaders(chains: Chains) -> None:
    """Put preferred positions of joints that follow where their leaders are; relate them to these."""
    for f, k in np.ndindex(chains.index.shape):
        g, m = chains.kinds[f, k, LEADER_FINGER], chains.kinds[f, k, LEADER]
        if (f, k) == (g, m) or k >= chains.counts[f]:
            continue
        leader, own = chains.limits[g, m], chains.limits[f, k]
        own[RATIO] = own[VECTOR_RATIO] / leader[VECTOR_RATIO]
        own[OFFSET] = own[VECTOR_OFFSET] - own[RATIO] * leader[VECTOR_OFFSET]
        own[PREFERRED] = own[RATIO] * leader[PREFERRED] + own[OFFSET]


def _finger_joints(model: pinocchio.Model, finger: FingerDescription, hand: str) -> list[int]:
    frame = model.frames[_frame(model, finger.tip, hand)]
    support = [j for j in model.supports[frame.parentJoint] if j != 0]
    if not support:
        raise HandError(
            f"no joint moves the tip '{finger.tip}' of finger '{finger.name}' of hand '{hand}'",
            remedy="name a tip link at the end of a finger",
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


def motion_axis(model: pinocchio.Model, joint: int, hand: str) -> tuple[bool, FloatArray]:
    """Return whether a joint slides, and its axis in its own frame."""
    if model.joints[joint].nq <= 1:
        # The motion between two positions says it for every kind, joints that follow included.
        data, q = model.createData(), np.zeros(model.nq)
        pinocchio.forwardKinematics(model, data, q)
        before = data.liMi[joint].copy()
        q[model.joints[joint].idx_q] = _NUDGE / coupling(model, joint)[0]
        pinocchio.forwardKinematics(model, data, q)
        twist = pinocchio.log6(before.actInv(data.liMi[joint])).vector / _NUDGE
        linear, angular = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
        if abs(angular - 1.0) < _AXIS_TOLERANCE and linear < _AXIS_TOLERANCE:
            return False, np.asarray(twist[3:], dtype=float)
        if abs(linear - 1.0) < _AXIS_TOLERANCE and angular < _AXIS_TOLERANCE:
            return True, np.asarray(twist[:3], dtype=float)
    raise HandError(
        f"joint '{model.names[joint]}' of hand '{hand}' neither turns about an axis nor slides along one",
        remedy="make it revolute or prismatic with limits, or fixed",
        joint=model.names[joint],
    )


def align_z(axis: FloatArray) -> FloatArray:
    """Return a rotation whose third column is the unit vector along ``axis``."""
    z = axis / np.linalg.norm(axis)
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _preferred(
    finger: FingerDescription, limits: FloatArray, kinds: IntArray, place: tuple[int, str]
) -> FloatArray:
    lower, upper = limits[:, LOWER], limits[:, UPPER]
    f, hand = place
    if not np.all(lower < upper):
        raise HandError(
            f"a joint of finger '{finger.name}' of hand '{hand}' has no range (lower limit not below upper)",
            remedy="give the joint limits in the URDF",
        )
    if finger.posture_deg is None:
        return np.asarray((lower + upper) / 2)
    own = (kinds[:, LEADER_FINGER] == f) & (kinds[:, LEADER] == np.arange(len(kinds)))
    given = finger.posture_deg
    if len(given) == len(own):
        given = tuple(value for value, is_own in zip(given, own, strict=True) if is_own)
    posture = (lower + upper) / 2
    if len(given) == int(own.sum()):
        posture[own] = joint_units(np.array(given), kinds[own, SLIDES])
    if len(given) != int(own.sum()) or np.any(posture <= lower) or np.any(posture >= upper):
        raise HandError(
            f"the posture of finger '{finger.name}' of hand '{hand}' does not lie within the limits of its "
            f"{int(own.sum())} joints",
            remedy="give one angle in degrees (of a sliding joint: millimetres) for each joint that follows "
            "no other, inside its limits",
            lower_deg=np.degrees(lower).round(2).tolist(),
            upper_deg=np.degrees(upper).round(2).tolist(),
        )
    return np.asarray(posture)


def joint_units(given: FloatArray, slides: IntArray) -> FloatArray:
    """Return joint positions of descriptions, deg or mm, in rad or m."""
    return np.where(np.asarray(slides) == 1, 1e-3 * given, np.radians(given))
