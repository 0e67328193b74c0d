"""When a motion is where: slowed down only where the joints could not follow (thesis 3.5)."""

import numpy as np

from graspbench.arrays import FloatArray

_WINDOW_S = 0.04
_MAX_SLOWDOWN = 4.0


def minimum_jerk(share: FloatArray) -> FloatArray:
    """Return the fifth order time law from 0 to 1 that starts and ends without speed and acceleration."""
    share = np.clip(share, 0.0, 1.0)
    law: FloatArray = share**3 * (10.0 + share * (-15.0 + 6.0 * share))
    return law


def slowdown(
    joints: FloatArray, step_s: float, velocity_limits: FloatArray, acceleration_limit: float
) -> FloatArray:
    """Return how many times slower each step has to be for the joints to keep their limits.

    Args:
        joints: Shape (t, n_q), rad.
        step_s: Time between samples.
        velocity_limits: Shape (n_q,), rad/s.
        acceleration_limit: rad/s^2.

    Returns:
        At least 1, shape (t - 1,).
    """
    speeds = np.diff(joints, axis=0, prepend=joints[:1], append=joints[-1:]) / step_s
    slower: FloatArray = np.maximum(1.0, (np.abs(speeds[1:-1]) / velocity_limits).max(axis=1))
    # Before and after the motion the joints are at rest.
    changes = np.abs(np.diff(speeds, axis=0)).max(axis=1)
    sharpest = np.sqrt(changes / (step_s * acceleration_limit))
    slower = np.maximum(slower, np.maximum(sharpest[:-1], sharpest[1:]))
    return slower


def smooth_durations(slower: FloatArray, step_s: float) -> FloatArray:
    """Return durations of the steps, smooth and at least ``slower`` steps each, shape (t - 1,), s.

    One pass makes no step more than a few times longer: what looks like a jump often is not one when the
    motion passes there slowly.
    """
    half = max(1, round(_WINDOW_S / step_s))
    wanted = np.minimum(1.02 * slower, _MAX_SLOWDOWN)
    wanted[slower <= 1.0] = 1.0
    # As many means as maxima over the same window: nowhere less than the values themselves.
    for reduce in (np.max, np.max, np.mean, np.mean):
        around = np.pad(wanted, half, mode="edge")
        wanted = reduce(np.lib.stride_tricks.sliding_window_view(around, 2 * half + 1), axis=1)
    return step_s * np.maximum(wanted, 1.0)


def resampled(values: FloatArray, durations: FloatArray, step_s: float) -> tuple[FloatArray, FloatArray]:
    """Sample a motion anew, its steps lasting as long as they are told to.

    Args:
        values: The motion, shape (n, t, 3).
        durations: Of its steps, shape (t - 1,), s.
        step_s: Time between the new samples.

    Returns:
        The motion at the new samples, first and last as before, shape (n, u, 3), and when each of the old
        samples is reached, in new samples, shape (t,).
    """
    # Loading scipy's interpolation takes long, and only who asks for paths needs it.
    from scipy.interpolate import CubicSpline

    when = np.concatenate(([0.0], np.cumsum(durations))) / step_s
    count = max(2, int(np.ceil(when[-1] - 1e-9)) + 1)
    when *= (count - 1) / when[-1]
    sampled: FloatArray = CubicSpline(when, values, axis=1, bc_type="natural")(np.arange(count))
    return sampled, when
