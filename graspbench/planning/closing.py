"""How fingers close that cannot place their tips by themselves: each along the curve that its joints allow.

Fingers of one or two joints, or with joints that follow others, cannot follow any path of their tips while
the palm is still. They open from the grasp as far as their joints take the tips away from the object, and
close the same way back.
"""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import PlanningError
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture
from graspbench.hand.touching import touching
from graspbench.planning.parameters import PathParameters
from graspbench.planning.time_law import minimum_jerk

_STEP_M = 5e-4
_DAMPING = 1e-6
_MAX_STEPS = 200
_LEAST_M = 0.8e-3
_PEAK = 1.875  # of the speed along a minimum-jerk motion, in mean speeds


def closing_motion(
    hand: HandModel, posture: HandPosture, normals: FloatArray, distance_m: float, parameters: PathParameters
) -> FloatArray:
    """Return the joints from open to the grasp, at rest at both ends, shape (t, n_q).

    Args:
        hand: The hand.
        posture: The grasp's posture, where the motion ends.
        normals: Outward normals of the contacts in the world, shape (n_f, 3).
        distance_m: How far the tips move away from the object, where the joints allow it.
        parameters: Speeds and sampling.

    Raises:
        PlanningError: The joints do not take the tips away from the object.
    """
    hand = touching(hand, posture, normals)
    outwards = normals @ posture.transform_palm_to_world[:3, :3]
    way = _opening(hand, posture, outwards, distance_m)[::-1]
    lengths = np.linalg.norm(np.diff(_tips(hand, posture, way), axis=0), axis=-1).max(axis=1)
    along = np.concatenate(([0.0], np.cumsum(np.maximum(lengths, 1e-9))))
    rates = np.abs(np.diff(way, axis=0)) / np.diff(along)[:, None]
    slow = (rates / (parameters.velocity_share * hand.velocity_limits)).max()
    lasting = max(
        parameters.closing_time_s,
        _PEAK * along[-1] * max(float(slow), 1.0 / parameters.tip_speed_m_s),
    )
    count = max(2, round(lasting / parameters.time_step_s))
    at = along[-1] * minimum_jerk(np.arange(count + 1) / count)
    return np.column_stack([np.interp(at, along, way[:, i]) for i in range(way.shape[1])])


def tip_paths(hand: HandModel, posture: HandPosture, normals: FloatArray, joints: FloatArray) -> FloatArray:
    """Return where the foremost points of the tips are along a motion, in the world, shape (t, n_f, 3)."""
    hand, to_world = touching(hand, posture, normals), posture.transform_palm_to_world
    centres = _tips(hand, posture, joints) @ to_world[:3, :3].T + to_world[:3, 3]
    return np.asarray(centres - hand.tip_radius_m * normals)


def _tips(hand: HandModel, posture: HandPosture, way: FloatArray) -> FloatArray:
    return np.stack([hand.tip_positions(joints)[list(posture.fingers)] for joints in way])


def _opening(hand: HandModel, posture: HandPosture, outwards: FloatArray, distance_m: float) -> FloatArray:
    """Return joints from the grasp outwards, shape (n, n_q), in steps of half a millimetre of the tips."""
    fingers = list(posture.fingers)
    way = [posture.joints]
    first = hand.tip_positions(posture.joints)[fingers]
    for _ in range(_MAX_STEPS):
        gaps = np.sum((hand.tip_positions(way[-1])[fingers] - first) * outwards, axis=1)
        missing = np.clip(distance_m - gaps, 0.0, _STEP_M)
        if np.all(missing <= 0.0):
            break
        jacobian = hand.tip_jacobians(way[-1])[fingers].reshape(-1, hand.n_joints)
        # Only the component along the normal counts: the joints choose the rest.
        rows = np.einsum("fi,fij->fj", outwards, jacobian.reshape(len(fingers), 3, -1))
        gram = rows @ rows.T + _DAMPING * np.eye(len(fingers))
        step = rows.T @ np.linalg.solve(gram, missing)
        after = np.clip(way[-1] + step, hand.lower, hand.upper)
        if np.abs(after - way[-1]).max() < 1e-6:
            break
        way.append(after)
    opened = np.sum((hand.tip_positions(way[-1])[fingers] - first) * outwards, axis=1)
    if opened.min() < _LEAST_M:
        name = hand.finger_names[fingers[int(opened.argmin())]]
        raise PlanningError(
            f"finger '{name}' of hand '{hand.name}' cannot open from its contact: its joints take its tip "
            f"{1e3 * float(opened.min()):.1f} mm away",
            remedy="take another object, or another posture of the fingers (hand.chains)",
        )
    return np.array(way)
