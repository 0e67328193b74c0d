"""Compiled kinematics of fingers: forward, differential and inverse, one at a time or in batches.

All positions are in the palm frame.
"""

import math
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import BoolArray, FloatArray
from graspbench.compiled import compiled, inner
from graspbench.hand.chains import LOWER, PREFERRED, SLIDES, UPPER, Chains

IK_ITERATIONS = 40
IK_TOLERANCE_M = 1e-9
FADED = 1e-2  # a pull below this gain is over


@dataclass(frozen=True)
class FingerSolutions:
    """Inverse kinematics of one finger for m targets.

    Attributes:
        joints: Joints that bring the tip as close as they can, within limits, shape (m, k), rad.
        error_m: Distances left between tip and target, shape (m,).
        joint_margin: Smallest distance of a joint to a limit as a share of its range, shape (m,).
        smallest_singular_value: Of the tip Jacobian, shape (m,), m/rad.
    """

    joints: FloatArray
    error_m: FloatArray
    joint_margin: FloatArray
    smallest_singular_value: FloatArray


@inner
def forward(chains: Chains, f: int, joints: FloatArray, frames: FloatArray, tip: FloatArray) -> None:
    """Compute joint frames and tip of finger ``f``.

    Args:
        chains: The fingers.
        f: Which finger.
        joints: Joint positions, shape (k,).
        frames: Output, joint frames: rotation, whose column 2 is the joint axis, and origin, shape (k, 3, 4).
        tip: Output, tip centre, shape (3,).
    """
    n = chains.counts[f]
    for j in range(n):
        c, s, slide = math.cos(joints[j]), math.sin(joints[j]), 0.0
        if chains.kinds[f, j, SLIDES] == 1:
            c, s, slide = 1.0, 0.0, joints[j]
        for row in range(3):
            if j == 0:
                a, b, z = chains.fixed[f, j, row, 0], chains.fixed[f, j, row, 1], chains.fixed[f, j, row, 2]
                origin = chains.fixed[f, j, row, 3]
            else:
                p, q, r = frames[j - 1, row, 0], frames[j - 1, row, 1], frames[j - 1, row, 2]
                a = p * chains.fixed[f, j, 0, 0] + q * chains.fixed[f, j, 1, 0] + r * chains.fixed[f, j, 2, 0]
                b = p * chains.fixed[f, j, 0, 1] + q * chains.fixed[f, j, 1, 1] + r * chains.fixed[f, j, 2, 1]
                z = p * chains.fixed[f, j, 0, 2] + q * chains.fixed[f, j, 1, 2] + r * chains.fixed[f, j, 2, 2]
                origin = (
                    p * chains.fixed[f, j, 0, 3] + q * chains.fixed[f, j, 1, 3] + r * chains.fixed[f, j, 2, 3]
                )
                origin += frames[j - 1, row, 3]
            frames[j, row, 0] = c * a + s * b
            frames[j, row, 1] = c * b - s * a
            frames[j, row, 2] = z
            frames[j, row, 3] = origin + slide * z
    x, y, z = chains.tips[f, 0], chains.tips[f, 1], chains.tips[f, 2]
    for row in range(3):
        tip[row] = (
            frames[n - 1, row, 0] * x
            + frames[n - 1, row, 1] * y
            + frames[n - 1, row, 2] * z
            + frames[n - 1, row, 3]
        )


@inner
def point_jacobian(last: int, frames: FloatArray, x: float, y: float, z: float, jacobian: FloatArray) -> None:
    """Jacobian of a point fixed to the link behind joint ``last``; further columns become zero.

    Args:
        last: Position of the joint that carries the point.
        frames: Joint frames, shape (k, 3, 4).
        x: Point.
        y: Point.
        z: Point.
        jacobian: Output, shape (3, k).
    """
    for j in range(jacobian.shape[1]):
        u, v, w = 0.0, 0.0, 0.0
        a, b, c = x, y, z
        if j <= last:
            u, v, w = frames[j, 0, 2], frames[j, 1, 2], frames[j, 2, 2]
            a, b, c = x - frames[j, 0, 3], y - frames[j, 1, 3], z - frames[j, 2, 3]
        jacobian[0, j] = v * c - w * b
        jacobian[1, j] = w * a - u * c
        jacobian[2, j] = u * b - v * a


@inner
def smallest_singular_value(jacobian: FloatArray) -> float:
    """Return the smallest singular value of a matrix of shape (3, k), k >= 3, in closed form."""
    a = b = c = d = e = f = 0.0
    for j in range(jacobian.shape[1]):
        x, y, z = jacobian[0, j], jacobian[1, j], jacobian[2, j]
        a += x * x
        b += y * y
        c += z * z
        d += x * y
        e += y * z
        f += x * z
    # Eigenvalues of a symmetric 3 x 3 matrix by the trigonometric formula (Smith 1961).
    mean = (a + b + c) / 3.0
    p = (a - mean) ** 2 + (b - mean) ** 2 + (c - mean) ** 2 + 2.0 * (d * d + e * e + f * f)
    if p < 1e-30:
        return math.sqrt(max(mean, 0.0))
    p = math.sqrt(p / 6.0)
    a, b, c, d, e, f = (a - mean) / p, (b - mean) / p, (c - mean) / p, d / p, e / p, f / p
    half = 0.5 * (a * (b * c - e * e) - d * (d * c - e * f) + f * (d * e - b * f))
    angle = math.acos(min(1.0, max(-1.0, half))) / 3.0
    return math.sqrt(max(mean + 2.0 * p * math.cos(angle + 2.0 * math.pi / 3.0), 0.0))


@inner
def joint_margin(chains: Chains, f: int, joints: FloatArray) -> float:
    """Return the smallest distance of a joint to a limit as a share of its range (negative outside)."""
    margin = 0.5
    for j in range(chains.counts[f]):
        low, high = chains.limits[f, j, LOWER], chains.limits[f, j, UPPER]
        margin = min(margin, min(joints[j] - low, high - joints[j]) / (high - low))
    return margin


@inner
def _damped_step(
    count: int,
    jacobian: FloatArray,
    gap: FloatArray,
    secondary: FloatArray,
    free: BoolArray,
    damping: float,
    step: FloatArray,
) -> None:
    """Set ``step`` to secondary + J^T (J J^T + damping)^-1 (gap - J secondary) over the free joints."""
    x, y, z = gap[0], gap[1], gap[2]
    a = b = c = damping
    d = e = f = 0.0
    for j in range(count):
        if free[j]:
            u, v, w = jacobian[0, j], jacobian[1, j], jacobian[2, j]
            x, y, z = x - u * secondary[j], y - v * secondary[j], z - w * secondary[j]
            a, b, c = a + u * u, b + v * v, c + w * w
            d, e, f = d + u * v, e + v * w, f + u * w
    # The symmetric 3 x 3 system [[a, d, f], [d, b, e], [f, e, c]] by cofactors.
    xx, yy, zz = b * c - e * e, a * c - f * f, a * b - d * d
    xy, yz, xz = e * f - c * d, d * f - a * e, d * e - b * f
    scale = 1.0 / (a * xx + d * xy + f * xz)
    p = scale * (xx * x + xy * y + xz * z)
    q = scale * (xy * x + yy * y + yz * z)
    r = scale * (xz * x + yz * y + zz * z)
    for j in range(count):
        step[j] = 0.0
        if free[j]:
            step[j] = secondary[j] + jacobian[0, j] * p + jacobian[1, j] * q + jacobian[2, j] * r


@inner
def finger_ik(
    chains: Chains,
    f: int,
    target: FloatArray,
    joints: FloatArray,
    frames: FloatArray,
    jacobian: FloatArray,
    centring: float,
) -> float:
    """Bring the tip of finger ``f`` to a target by damped least squares within the joint limits.

    For fingers of three or more joints that turn and follow none. Joints that a step would push out of their
    range are taken out of that step. What freedom is left
    pulls the joints towards their preferred positions.

    Args:
        chains: The fingers.
        f: Which finger.
        target: Wanted tip centre, shape (3,).
        joints: Start; the solution is written over it, shape (k,).
        frames: Work space; the joint frames at the solution, shape (k, 3, 4).
        jacobian: Work space; the tip Jacobian at the solution, shape (3, k).
        centring: Gain of the pull towards the preferred joints, 0 to 1.

    Returns:
        Distance left between tip and target, m.
    """
    n = chains.counts[f]
    tip, gap, free = np.empty(3), np.empty(3), np.empty(n, dtype=np.bool_)
    secondary, step, trial = np.empty(n), np.empty(n), np.empty(n)
    for j in range(n):
        trial[j] = joints[j]
    square, damping, gain = np.inf, 1e-6, centring
    for iteration in range(IK_ITERATIONS):
        for j in range(n):
            trial[j] = min(chains.limits[f, j, UPPER], max(chains.limits[f, j, LOWER], trial[j]))
        forward(chains, f, trial, frames, tip)
        after = (target[0] - tip[0]) ** 2 + (target[1] - tip[1]) ** 2 + (target[2] - tip[2]) ** 2
        if iteration == 0 or after < square or gain > FADED:
            stalled = gain <= FADED and after > 0.9999 * square
            damping = max(damping * 0.1, 1e-12)
            square = after
            for j in range(n):
                joints[j] = trial[j]
            # The pull fades out so that the last iterations converge on the target alone.
            gain *= 0.75
            if (square < IK_TOLERANCE_M**2 and gain <= FADED) or (stalled and damping <= 1e-9):
                break
        else:
            damping *= 10.0
            if damping > 1e-1:
                break
            forward(chains, f, joints, frames, tip)
        point_jacobian(n - 1, frames, tip[0], tip[1], tip[2], jacobian)
        for row in range(3):
            gap[row] = target[row] - tip[row]
        for j in range(n):
            free[j] = True
            secondary[j] = gain * (chains.limits[f, j, PREFERRED] - joints[j]) if gain > FADED else 0.0
        blocked = True
        while blocked:
            _damped_step(n, jacobian, gap, secondary, free, damping, step)
            blocked = False
            for j in range(n):
                trial[j] = joints[j] + min(0.5, max(-0.5, step[j]))
                low = joints[j] <= chains.limits[f, j, LOWER] and step[j] < 0.0
                high = joints[j] >= chains.limits[f, j, UPPER] and step[j] > 0.0
                if free[j] and (low or high):
                    free[j] = False
                    blocked = True
    forward(chains, f, joints, frames, tip)
    point_jacobian(n - 1, frames, tip[0], tip[1], tip[2], jacobian)
    return math.sqrt(square)


@compiled
def finger_ik_batch(
    chains: Chains, f: int, targets: FloatArray, joints: FloatArray, centring: float, quantities: FloatArray
) -> None:
    """Solve ``finger_ik`` for many targets; a start that fails is tried again from the preferred posture.

    Args:
        chains: The fingers.
        f: Which finger.
        targets: Wanted tip centres, shape (m, 3).
        joints: Starts; the solutions are written over them, shape (m, k).
        centring: Gain of the pull towards the preferred joints, 0 to 1.
        quantities: Output: error, joint margin, smallest singular value, shape (3, m).
    """
    n = chains.counts[f]
    frames, jacobian, start = np.empty((n, 3, 4)), np.empty((3, n)), np.empty(n)
    for i in range(targets.shape[0]):
        error = np.inf
        for trial in range(2):
            for j in range(n):
                start[j] = joints[i, j] if trial == 0 else chains.limits[f, j, PREFERRED]
            left = finger_ik(chains, f, targets[i], start, frames, jacobian, centring if trial == 0 else 1.0)
            if left < error:
                error = left
                for j in range(n):
                    joints[i, j] = start[j]
                quantities[2, i] = smallest_singular_value(jacobian)
            if error < 1e-6:
                break
        quantities[0, i] = error
        quantities[1, i] = joint_margin(chains, f, joints[i])
