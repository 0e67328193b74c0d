"""Compiled kinematics of fingers: forward, differential and inverse, one at a time or in batches.

All positions are in the palm frame.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from graspbench.arrays import FloatArray
from graspbench.hand.chains import Chains

IK_ITERATIONS = 40
IK_TOLERANCE_M = 1e-9


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


@njit(cache=True, nogil=True)
def forward(
    chains: Chains, f: int, joints: FloatArray, rotations: FloatArray, origins: FloatArray, tip: FloatArray
) -> None:
    """Compute joint frames and tip of finger ``f``.

    Args:
        chains: The fingers.
        f: Which finger.
        joints: Joint positions, shape (k,).
        rotations: Output, orientations of the joint frames, shape (k, 3, 3); column 2 is the joint axis.
        origins: Output, origins of the joint frames, shape (k, 3).
        tip: Output, tip centre, shape (3,).
    """
    n = chains.counts[f]
    for j in range(n):
        fixed, offset = chains.rotations[f, j], chains.offsets[f, j]
        c, s = math.cos(joints[j]), math.sin(joints[j])
        for row in range(3):
            if j == 0:
                a, b, z = fixed[row, 0], fixed[row, 1], fixed[row, 2]
                origins[j, row] = offset[row]
            else:
                p0, p1, p2 = rotations[j - 1, row, 0], rotations[j - 1, row, 1], rotations[j - 1, row, 2]
                a = p0 * fixed[0, 0] + p1 * fixed[1, 0] + p2 * fixed[2, 0]
                b = p0 * fixed[0, 1] + p1 * fixed[1, 1] + p2 * fixed[2, 1]
                z = p0 * fixed[0, 2] + p1 * fixed[1, 2] + p2 * fixed[2, 2]
                origins[j, row] = origins[j - 1, row] + p0 * offset[0] + p1 * offset[1] + p2 * offset[2]
            rotations[j, row, 0] = c * a + s * b
            rotations[j, row, 1] = c * b - s * a
            rotations[j, row, 2] = z
    t = chains.tips[f]
    for row in range(3):
        r = rotations[n - 1, row]
        tip[row] = origins[n - 1, row] + r[0] * t[0] + r[1] * t[1] + r[2] * t[2]


@njit(cache=True, nogil=True)
def point_jacobian(
    last: int, rotations: FloatArray, origins: FloatArray, point: FloatArray, jacobian: FloatArray
) -> None:
    """Jacobian of a point fixed to the link behind joint ``last``; further columns become zero.

    Args:
        last: Position of the joint that carries the point.
        rotations: Orientations of the joint frames, shape (k, 3, 3).
        origins: Origins of the joint frames, shape (k, 3).
        point: The point, shape (3,).
        jacobian: Output, shape (3, k).
    """
    for j in range(jacobian.shape[1]):
        if j > last:
            jacobian[0, j] = jacobian[1, j] = jacobian[2, j] = 0.0
            continue
        x, y, z = rotations[j, 0, 2], rotations[j, 1, 2], rotations[j, 2, 2]
        a, b, c = point[0] - origins[j, 0], point[1] - origins[j, 1], point[2] - origins[j, 2]
        jacobian[0, j] = y * c - z * b
        jacobian[1, j] = z * a - x * c
        jacobian[2, j] = x * b - y * a


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def joint_margin(chains: Chains, f: int, joints: FloatArray) -> float:
    """Return the smallest distance of a joint to a limit as a share of its range (negative outside)."""
    margin = 0.5
    for j in range(chains.counts[f]):
        low, high = chains.lower[f, j], chains.upper[f, j]
        margin = min(margin, min(joints[j] - low, high - joints[j]) / (high - low))
    return margin


@njit(cache=True, nogil=True)
def solve_symmetric_3(
    a: float, b: float, c: float, d: float, e: float, f: float, rhs: FloatArray, out: FloatArray
) -> None:
    """Solve [[a, d, f], [d, b, e], [f, e, c]] out = rhs by cofactors."""
    xx, yy, zz = b * c - e * e, a * c - f * f, a * b - d * d
    xy, yz, xz = e * f - c * d, d * f - a * e, d * e - b * f
    scale = 1.0 / (a * xx + d * xy + f * xz)
    out[0] = scale * (xx * rhs[0] + xy * rhs[1] + xz * rhs[2])
    out[1] = scale * (xy * rhs[0] + yy * rhs[1] + yz * rhs[2])
    out[2] = scale * (xz * rhs[0] + yz * rhs[1] + zz * rhs[2])


@njit(cache=True, nogil=True)
def finger_ik(
    chains: Chains,
    f: int,
    target: FloatArray,
    joints: FloatArray,
    rotations: FloatArray,
    origins: FloatArray,
    jacobian: FloatArray,
    centring: float,
) -> float:
    """Bring the tip of finger ``f`` to a target by damped least squares within the joint limits.

    Joints that a step would push out of their range are taken out of that step. What freedom is left
    pulls the joints towards the middle of their ranges.

    Args:
        chains: The fingers.
        f: Which finger.
        target: Wanted tip centre, shape (3,).
        joints: Start; the solution is written over it, shape (k,).
        rotations: Work space, shape (k, 3, 3).
        origins: Work space, shape (k, 3).
        jacobian: Work space, the tip Jacobian at the solution, shape (3, k).
        centring: Gain of the pull towards mid-range, 0 to 1.

    Returns:
        Distance left between tip and target, m.
    """
    n = chains.counts[f]
    lower, upper = chains.lower[f], chains.upper[f]
    tip, error, dual = np.empty(3), np.empty(3), np.empty(3)
    free = np.empty(n, dtype=np.bool_)
    secondary = np.zeros(n)
    trial = np.empty(n)
    for j in range(n):
        joints[j] = min(upper[j], max(lower[j], joints[j]))
    forward(chains, f, joints, rotations, origins, tip)
    square = (target[0] - tip[0]) ** 2 + (target[1] - tip[1]) ** 2 + (target[2] - tip[2]) ** 2
    damping = 1e-6
    for iteration in range(IK_ITERATIONS):
        # The pull fades out so that the last iterations converge on the target alone.
        gain = centring * 0.75**iteration
        if square < IK_TOLERANCE_M**2 and gain < 1e-2:
            break
        point_jacobian(n - 1, rotations, origins, tip, jacobian)
        for j in range(n):
            free[j] = True
            secondary[j] = gain * (chains.preferred[f, j] - joints[j])
        for _ in range(n):
            for row in range(3):
                error[row] = target[row] - tip[row]
                for j in range(n):
                    if free[j]:
                        error[row] -= jacobian[row, j] * secondary[j]
            a = b = c = damping
            d = e = g = 0.0
            for j in range(n):
                if free[j]:
                    x, y, z = jacobian[0, j], jacobian[1, j], jacobian[2, j]
                    a += x * x
                    b += y * y
                    c += z * z
                    d += x * y
                    e += y * z
                    g += x * z
            solve_symmetric_3(a, b, c, d, e, g, error, dual)
            blocked = False
            for j in range(n):
                trial[j] = joints[j]
                if not free[j]:
                    continue
                step = (
                    secondary[j]
                    + jacobian[0, j] * dual[0]
                    + jacobian[1, j] * dual[1]
                    + jacobian[2, j] * dual[2]
                )
                trial[j] += min(0.5, max(-0.5, step))
                if trial[j] < lower[j] or trial[j] > upper[j]:
                    at_limit = joints[j] <= lower[j] or joints[j] >= upper[j]
                    trial[j] = min(upper[j], max(lower[j], trial[j]))
                    if at_limit:
                        free[j] = False
                        blocked = True
            if not blocked:
                break
        forward(chains, f, trial, rotations, origins, tip)
        after = (target[0] - tip[0]) ** 2 + (target[1] - tip[1]) ** 2 + (target[2] - tip[2]) ** 2
        if after < square or gain > 1e-2:
            stalled = after > 0.9999 * square and gain <= 1e-2
            damping = max(damping * 0.1, 1e-12)
            square = after
            for j in range(n):
                joints[j] = trial[j]
            if stalled and damping <= 1e-9:
                break
        else:
            damping *= 10.0
            if damping > 1e-1:
                forward(chains, f, joints, rotations, origins, tip)
                break
            forward(chains, f, joints, rotations, origins, tip)
    point_jacobian(n - 1, rotations, origins, tip, jacobian)
    return math.sqrt(square)


@njit(cache=True, nogil=True)
def finger_ik_batch(
    chains: Chains,
    f: int,
    targets: FloatArray,
    starts: FloatArray,
    centring: float,
    joints: FloatArray,
    error: FloatArray,
    margin: FloatArray,
    singular: FloatArray,
) -> None:
    """Solve ``finger_ik`` for many targets; a start that fails is tried again from the preferred posture.

    Args:
        chains: The fingers.
        f: Which finger.
        targets: Wanted tip centres, shape (m, 3).
        starts: Starts, shape (m, k).
        centring: Gain of the pull towards mid-range, 0 to 1.
        joints: Output, shape (m, k).
        error: Output, shape (m,).
        margin: Output, joint margins, shape (m,).
        singular: Output, smallest singular values, shape (m,).
    """
    n = chains.counts[f]
    rotations, origins, jacobian = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((3, n))
    again, other = np.empty(n), np.empty((3, n))
    for i in range(targets.shape[0]):
        joints[i] = starts[i]
        error[i] = finger_ik(chains, f, targets[i], joints[i], rotations, origins, jacobian, centring)
        if error[i] > 1e-6:
            again[:] = chains.preferred[f, :n]
            left = finger_ik(chains, f, targets[i], again, rotations, origins, other, 1.0)
            if left < error[i]:
                error[i] = left
                joints[i] = again
                jacobian[:] = other
        margin[i] = joint_margin(chains, f, joints[i])
        singular[i] = smallest_singular_value(jacobian)
