"""Motion control: joint paths that make the fingertips follow their paths (thesis 3.5).

Closed-loop inverse kinematics, one loop a finger: q' = J^+ (v + K e) + N (towards the grasp's joints), with
v the path's velocity, e the tip's error and N the projector onto the finger's free motion. When a joint would
have to turn faster than it can, or too abruptly, the whole motion is slowed down, so that all fingers still
touch together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import compiled, inner
from graspbench.errors import PlanningError
from graspbench.hand.chains import Chains
from graspbench.hand.kinematics import forward, point_jacobian
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture
from graspbench.hand.touching import touching
from graspbench.planning.closing import closing_motion
from graspbench.planning.parameters import PathParameters
from graspbench.planning.time_law import minimum_jerk, resampled, slowdown, smooth_durations
from graspbench.planning.trajectory import FingertipPath

_POSTURE_GAIN = 3.0
_FADE_S = 0.3
_DAMPING = 1e-8
_CREEP = 20.0  # largest speed towards a joint limit per distance to it, 1/s
_ATTEMPTS, _LOCAL_ATTEMPTS = 24, 16
_MAX_EXTRA_S = 10.0
_TRACKING_TOLERANCE_M = 5e-4


@dataclass(frozen=True)
class JointPath:
    """The motion of a whole hand: it arrives, follows the fingertips' paths, and closes.

    Attributes:
        times: Shape (t,), s.
        joints: Shape (t, n_q), rad.
        velocities: Joint velocities from each sample to the next, zero at the last, shape (t, n_q), rad/s.
        transform_palm_to_world: Pose of the palm, shape (t, 4, 4).
        tip_error_m: Distance of every used tip from its path, shape (t, n_f).
        following: First sample that follows the fingertips' paths; before it the open hand arrives.
        closing: First sample of the last approach.
    """

    times: FloatArray
    joints: FloatArray
    velocities: FloatArray
    transform_palm_to_world: FloatArray
    tip_error_m: FloatArray
    following: int
    closing: int


def track(
    paths: Sequence[FingertipPath], hand: HandModel, posture: HandPosture, parameters: PathParameters
) -> JointPath:
    """Follow the fingertips' paths with a hand.

    The hand opens to the beginning of the paths, arrives against its approach direction from
    ``retreat_m`` away with still fingers, and then follows the paths with a still palm.

    Args:
        paths: One for each contact, same times.
        hand: The hand.
        posture: The grasp's posture, where the paths end.
        parameters: Gains, velocity share and arrival.

    Raises:
        PlanningError: A finger does not reach the beginning of its path, or cannot follow it.
    """
    if len(paths) != len(posture.fingers):
        raise PlanningError(f"{len(paths)} fingertip paths for a posture of {len(posture.fingers)} fingers")
    hand = touching(hand, posture, np.stack([path.normals[-1] for path in paths]))
    to_world = posture.transform_palm_to_world
    centres = np.stack([path.points + hand.tip_radius_m * path.normals for path in paths])
    targets = (centres - to_world[:3, 3]) @ to_world[:3, :3]
    if hand.places_by_wrist:
        normals = np.stack([path.normals[-1] for path in paths])
        joints = closing_motion(hand, posture, normals, paths[0].floating_distance_m, parameters)
        start, closing = joints[0], paths[0].closing
        reached = np.stack([hand.tip_positions(each)[list(posture.fingers)] for each in joints], axis=1)
        errors = np.linalg.norm(reached - targets, axis=-1).T
    else:
        start = _start_joints(hand, posture, targets[:, 0])
        joints, errors, closing = _timed(hand, posture, targets, start, paths[0].closing, parameters)

    step, following = parameters.time_step_s, _arrival_samples(parameters)
    poses = np.tile(to_world, (following + len(joints), 1, 1))
    away = parameters.retreat_m * (1.0 - minimum_jerk(np.arange(following) / max(following, 1)))
    poses[:following, :3, 3] -= away[:, None] * to_world[:3, 2]
    joints = np.concatenate((np.tile(start, (following, 1)), joints))
    errors = np.concatenate((np.tile(errors[:1], (following, 1)), errors))
    velocities = np.concatenate((np.diff(joints, axis=0) / step, np.zeros((1, joints.shape[1]))))
    return JointPath(
        times=step * np.arange(len(joints), dtype=np.float64),
        joints=joints,
        velocities=velocities,
        transform_palm_to_world=poses,
        tip_error_m=errors,
        following=following,
        closing=following + closing,
    )


def _timed(
    hand: HandModel,
    posture: HandPosture,
    targets: FloatArray,
    start: FloatArray,
    closing: int,
    parameters: PathParameters,
) -> tuple[FloatArray, FloatArray, int]:
    """Follow the tip centres' paths, slower where the joints ask for it.

    Returns:
        Joints, shape (t, n_q), tip errors, shape (t, n_f), and where the last approach begins.
    """
    step, limits = parameters.time_step_s, parameters.velocity_share * hand.velocity_limits
    longest = 5.0 * step * targets.shape[1] + _MAX_EXTRA_S
    for attempt in range(_ATTEMPTS):
        joints, errors = _follow(hand, posture, targets, start, step, parameters.tracking_gain)
        slower = slowdown(joints, step, limits, parameters.acceleration_limit_rad_s2)
        if slower.max() <= 1.0:
            break
        if attempt >= _LOCAL_ATTEMPTS:
            slower[:] = slower.max()
        durations = smooth_durations(slower, step)
        if durations.sum() > longest:
            break
        targets, when = resampled(targets, durations, step)
        closing = round(when[closing])
    left = float(errors.max())
    if left > _TRACKING_TOLERANCE_M or slower.max() > 1.0:
        finger = hand.finger_names[posture.fingers[int(errors.max(axis=0).argmax())]]
        raise PlanningError(
            f"finger '{finger}' cannot follow its path ({1e3 * left:.1f} mm are left)",
            remedy="lower planner.floating_distance_m",
        )
    return joints, errors, closing


def _start_joints(hand: HandModel, posture: HandPosture, targets: FloatArray) -> FloatArray:
    """Return the joints that hold all tips at the beginning of their paths, shape (n_q,)."""
    start = posture.joints.copy()
    for i, finger in enumerate(posture.fingers):
        own = hand.finger_joints(finger)
        solved = hand.finger_ik(finger, targets[i : i + 1], posture.joints[own])
        if solved.error_m[0] > 1e-4:
            raise PlanningError(
                f"finger '{hand.finger_names[finger]}' stays {1e3 * solved.error_m[0]:.1f} mm short of the "
                "beginning of its path",
                remedy="lower planner.floating_distance_m",
            )
        start[own] = solved.joints[0]
    return start


def _arrival_samples(parameters: PathParameters) -> int:
    """Return the number of samples of the arrival, at the mean speed of the tips."""
    return round(parameters.retreat_m / parameters.tip_speed_m_s / parameters.time_step_s)


def _follow(
    hand: HandModel, posture: HandPosture, targets: FloatArray, start: FloatArray, step: float, gain: float
) -> tuple[FloatArray, FloatArray]:
    """Return joints (t, n_q) and tip errors (t, n_f) along the tip centres' paths, shape (n_f, t, 3)."""
    joints = np.tile(start, (targets.shape[1], 1))
    errors = np.zeros((targets.shape[1], len(targets)))
    for i, finger in enumerate(posture.fingers):
        own = hand.finger_joints(finger)
        path = np.ascontiguousarray(joints[:, own])
        error = np.zeros(len(path))
        limits = np.stack((hand.lower[own], hand.upper[own]))
        _clik(
            hand.chains,
            finger,
            np.ascontiguousarray(targets[i]),
            posture.joints[own],
            limits,
            step,
            gain,
            path,
            error,
        )
        joints[:, own], errors[:, i] = path, error
    return joints, errors


@compiled
def _clik(
    chains: Chains,
    f: int,
    targets: FloatArray,
    goal: FloatArray,
    limits: FloatArray,
    step: float,
    gain: float,
    path: FloatArray,
    error: FloatArray,
) -> None:
    """Track ``targets`` with finger ``f`` from ``path[0]``; write joints and tip errors.

    Args:
        chains: The fingers.
        f: Which finger.
        targets: Tip centres in the palm frame, shape (t, 3).
        goal: Joints that the free motion is drawn to, shape (k,).
        limits: Lower and upper joint limits, shape (2, k).
        step: Time step, s.
        gain: Gain K of the tip error, 1/s.
        path: Joints; the first row is the start, shape (t, k).
        error: Distance of the tip from its target, shape (t,).
    """
    n = path.shape[1]
    frames, tip, jacobian = np.empty((n, 3, 4)), np.empty(3), np.empty((3, n))
    wanted, free, dual = np.empty(3), np.empty(n), np.empty(3)
    speed, held = np.empty(n), np.empty(n, dtype=np.bool_)
    for t in range(path.shape[0]):
        forward(chains, f, path[t], frames, tip)
        square = 0.0
        for a in range(3):
            square += (targets[t, a] - tip[a]) ** 2
        error[t] = np.sqrt(square)
        if t + 1 == path.shape[0]:
            break
        point_jacobian(n - 1, frames, tip[0], tip[1], tip[2], jacobian)
        # The free motion fades in, so that no joint jumps at the start.
        fading = min(1.0, t * step / _FADE_S)
        for j in range(n):
            free[j] = fading * _POSTURE_GAIN * (goal[j] - path[t, j])
            speed[j], held[j] = free[j], False
        for a in range(3):
            wanted[a] = (targets[t + 1, a] - targets[t, a]) / step + gain * (targets[t, a] - tip[a])
            for j in range(n):
                wanted[a] -= jacobian[a, j] * free[j]
        again = True
        while again:
            # A joint may only creep up to its limit; what it cannot do, the others take over.
            again = False
            _solve(jacobian, wanted, dual)
            for j in range(n):
                if held[j]:
                    continue
                speed[j] = free[j]
                for a in range(3):
                    speed[j] += jacobian[a, j] * dual[a]
                allowed = min(
                    _CREEP * (limits[1, j] - path[t, j]), max(_CREEP * (limits[0, j] - path[t, j]), speed[j])
                )
                if allowed != speed[j]:
                    held[j], again = True, True
                    for a in range(3):
                        wanted[a] -= jacobian[a, j] * (allowed - free[j])
                        jacobian[a, j] = 0.0
                    speed[j] = allowed
        for j in range(n):
            path[t + 1, j] = min(limits[1, j], max(limits[0, j], path[t, j] + step * speed[j]))


@inner
def _solve(jacobian: FloatArray, right: FloatArray, out: FloatArray) -> None:
    """Solve (J J^T + damping) out = right by cofactors."""
    a = b = c = _DAMPING
    d = e = f = 0.0
    for j in range(jacobian.shape[1]):
        x, y, z = jacobian[0, j], jacobian[1, j], jacobian[2, j]
        a, b, c = a + x * x, b + y * y, c + z * z
        d, e, f = d + x * y, e + y * z, f + x * z
    xx, yy, zz = b * c - e * e, a * c - f * f, a * b - d * d
    xy, yz, xz = e * f - c * d, d * f - a * e, d * e - b * f
    scale = 1.0 / (a * xx + d * xy + f * xz)
    out[0] = scale * (xx * right[0] + xy * right[1] + xz * right[2])
    out[1] = scale * (xy * right[0] + yy * right[1] + yz * right[2])
    out[2] = scale * (xz * right[0] + yz * right[1] + zz * right[2])
