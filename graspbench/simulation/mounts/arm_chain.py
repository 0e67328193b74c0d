"""A chain of joints in compiled code: where it is, how it follows a pose, and how well it stands there.

A chain is a tuple of arrays: placements of the joints in the links before them, shape (n, 3, 4); their axes,
shape (n, 3); whether they slide, shape (n,); the palm in the last joint's frame, shape (3, 4); lower and
upper limits and the middle between them, shape (n,) each; vertices of the links' hulls in their joints'
frames, shape (v, 3), and where those of each link begin, shape (n + 1,).
"""

from typing import TypeAlias

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled, inner

Chain: TypeAlias = tuple[
    FloatArray, FloatArray, BoolArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, IntArray
]
_DAMPED = 1e-8
_SMALL, _TINY = 1e-9, 1e-15
_SWEEPS = 12
_MAX_STEP, _ARRIVED = 0.5, 0.01
_FULL_TURN, _STEPS_FROM_AFAR = 2.0 * np.pi, 25


@inner
def _joint_frames(chain: Chain, q: FloatArray, frames: FloatArray, palm: FloatArray) -> None:
    """Set the joints' frames, shape (n, 3, 4), and the palm's, shape (3, 4), in the base frame."""
    placements, axes, slides, fixed = chain[0], chain[1], chain[2], chain[3]
    n = len(q)
    own = np.zeros((3, 4))
    for k in range(n):
        x, y, z = axes[k]
        if slides[k]:
            for i in range(3):
                for j in range(3):
                    own[i, j] = 1.0 if i == j else 0.0
                own[i, 3] = q[k] * axes[k, i]
        else:
            c, s = np.cos(q[k]), np.sin(q[k])
            v = 1.0 - c
            own[0, 0], own[0, 1], own[0, 2] = c + v * x * x, v * x * y - s * z, v * x * z + s * y
            own[1, 0], own[1, 1], own[1, 2] = v * x * y + s * z, c + v * y * y, v * y * z - s * x
            own[2, 0], own[2, 1], own[2, 2] = v * x * z - s * y, v * y * z + s * x, c + v * z * z
            own[0, 3] = own[1, 3] = own[2, 3] = 0.0
        _times(placements[k], own, frames[k])
        if k > 0:
            own[:] = frames[k]
            _times(frames[k - 1], own, frames[k])
    _times(frames[n - 1], fixed, palm)


@inner
def _times(a: FloatArray, b: FloatArray, found: FloatArray) -> None:
    """Set the product of two poses, shape (3, 4) each."""
    for i in range(3):
        for j in range(4):
            found[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
        found[i, 3] += a[i, 3]


@inner
def _jacobian(chain: Chain, frames: FloatArray, palm: FloatArray, found: FloatArray) -> None:
    """Set the palm's Jacobian in the base frame, shape (6, n): velocity first, then turning."""
    axes, slides = chain[1], chain[2]
    for k in range(len(axes)):
        for i in range(3):
            found[3 + i, k] = (
                frames[k, i, 0] * axes[k, 0] + frames[k, i, 1] * axes[k, 1] + frames[k, i, 2] * axes[k, 2]
            )
        if slides[k]:
            for i in range(3):
                found[i, k], found[3 + i, k] = found[3 + i, k], 0.0
            continue
        x, y, z = found[3, k], found[4, k], found[5, k]
        a, b, c = palm[0, 3] - frames[k, 0, 3], palm[1, 3] - frames[k, 1, 3], palm[2, 3] - frames[k, 2, 3]
        found[0, k], found[1, k], found[2, k] = y * c - z * b, z * a - x * c, x * b - y * a


@inner
def _error(palm: FloatArray, goal: FloatArray, found: FloatArray) -> None:
    """Set what is missing to the goal in the base frame, shape (6,): way, then the vector of rotation."""
    r = np.zeros((3, 3))
    for i in range(3):
        found[i] = goal[i, 3] - palm[i, 3]
        for j in range(3):
            r[i, j] = goal[i, 0] * palm[j, 0] + goal[i, 1] * palm[j, 1] + goal[i, 2] * palm[j, 2]
    found[3], found[4], found[5] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    sine = 0.5 * np.sqrt(found[3] ** 2 + found[4] ** 2 + found[5] ** 2)
    cosine = 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)
    angle = np.arctan2(sine, cosine)
    if sine > _SMALL:
        scale = 0.5 * angle / sine
    elif cosine > 0.0:
        scale = 0.5
    else:  # half a turn: the axis is the largest column of r + 1
        k = 0
        for i in range(1, 3):
            if r[i, i] > r[k, k]:
                k = i
        length = 0.0
        for i in range(3):
            found[3 + i] = r[i, k] + (1.0 if i == k else 0.0)
            length += found[3 + i] ** 2
        scale = angle / np.sqrt(length)
    for i in range(3, 6):
        found[i] *= scale


@inner
def _step(
    chain: Chain, now: FloatArray, goal: FloatArray, drift: FloatArray, frames: FloatArray, change: FloatArray
) -> None:
    """Set the change of joints of one damped Newton step to a goal, with a drift in what freedom is left."""
    n = len(now)
    palm, jac, error, square = np.zeros((3, 4)), np.zeros((6, n)), np.zeros(6), np.zeros((6, 6))
    _joint_frames(chain, now, frames, palm)
    _jacobian(chain, frames, palm, jac)
    _error(palm, goal, error)
    for i in range(6):
        for k in range(n):
            error[i] -= jac[i, k] * drift[k]
    _square(jac, square)
    for i in range(6):
        square[i, i] += _DAMPED
    _solve(square, error)
    for k in range(n):
        change[k] = drift[k]
        for i in range(6):
            change[k] += jac[i, k] * error[i]


@inner
def _square(jac: FloatArray, found: FloatArray) -> None:
    """Set the product of a Jacobian with its transpose, shape (6, 6)."""
    for i in range(6):
        for j in range(6):
            found[i, j] = 0.0
            for k in range(jac.shape[1]):
                found[i, j] += jac[i, k] * jac[j, k]


@inner
def _solve(square: FloatArray, x: FloatArray) -> None:
    """Solve a positive definite system in place, by Cholesky's factors."""
    for i in range(6):
        for j in range(i + 1):
            rest = square[i, j]
            for k in range(j):
                rest -= square[i, k] * square[j, k]
            square[i, j] = np.sqrt(max(rest, _TINY)) if i == j else rest / square[j, j]
    for i in range(6):
        for k in range(i):
            x[i] -= square[i, k] * x[k]
        x[i] /= square[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            x[i] -= square[k, i] * x[k]
        x[i] /= square[i, i]


@inner
def _least_eigenvalue(square: FloatArray) -> float:
    """Return the least eigenvalue of a symmetric matrix, (6, 6), by Jacobi's rotations; it is changed."""
    for _ in range(_SWEEPS):
        beside = 0.0
        for p in range(5):
            for q in range(p + 1, 6):
                beside = max(beside, abs(square[p, q]))
                if abs(square[p, q]) < _TINY:
                    continue
                ratio = 0.5 * (square[q, q] - square[p, p]) / square[p, q]
                t = 1.0 / (abs(ratio) + np.sqrt(ratio * ratio + 1.0))
                t = t if ratio >= 0.0 else -t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(6):
                    a, b = square[k, p], square[k, q]
                    square[k, p], square[k, q] = c * a - s * b, s * a + c * b
                for k in range(6):
                    a, b = square[p, k], square[q, k]
                    square[p, k], square[q, k] = c * a - s * b, s * a + c * b
        if beside < _TINY:
            break
    least: float = square[0, 0]
    for k in range(1, 6):
        least = min(least, square[k, k])
    return least


@inner
def _followed(
    chain: Chain, q: FloatArray, goal: FloatArray, centring: float, iterations: int, frames: FloatArray
) -> FloatArray:
    n, middle = len(q), chain[6]
    now, drift, change = q.copy(), np.zeros(n), np.zeros(n)
    for k in range(n):
        drift[k] = centring * (middle[k] - q[k])
    for _ in range(iterations):
        _step(chain, now, goal, drift, frames, change)
        for k in range(n):
            now[k] += change[k]
            drift[k] = 0.0
    return now


@compiled
def palm_pose(chain: Chain, q: FloatArray) -> FloatArray:
    """Return the palm's pose in the base frame, shape (4, 4), at joints of shape (n,)."""
    frames, palm, found = np.zeros((len(q), 3, 4)), np.zeros((3, 4)), np.eye(4)
    _joint_frames(chain, q, frames, palm)
    found[:3] = palm
    return found


@compiled
def jacobian(chain: Chain, q: FloatArray) -> FloatArray:
    """Return the palm's Jacobian in the base frame, shape (6, n): velocity first, then turning."""
    frames, palm, found = np.zeros((len(q), 3, 4)), np.zeros((3, 4)), np.zeros((6, len(q)))
    _joint_frames(chain, q, frames, palm)
    _jacobian(chain, frames, palm, found)
    return found


@compiled
def follow(chain: Chain, q: FloatArray, goal: FloatArray, centring: float, iterations: int) -> FloatArray:
    """Return joints, shape (n,), that bring the palm near a goal, shape (4, 4); see `ArmModel.follow`.

    Args:
        chain: The chain.
        q: Present joints, shape (n,).
        goal: Wanted pose of the palm in the base frame.
        centring: Share of the way to the middle of its range that each joint would go by itself.
        iterations: Newton steps.
    """
    return _followed(chain, q, goal, centring, iterations, np.zeros((len(q), 3, 4)))


@compiled
def reach(chain: Chain, seed: FloatArray, goal: FloatArray, centring: float) -> FloatArray:
    """Return joints, shape (n,), that bring the palm to a goal from afar; see `ArmModel.reach`.

    Args:
        chain: The chain.
        seed: Where to begin, shape (n,).
        goal: Wanted pose of the palm in the base frame, shape (4, 4).
        centring: As in `follow`, at each of its steps.
    """
    n, slides, lower, upper, middle = len(seed), chain[2], chain[4], chain[5], chain[6]
    frames, now, drift, change = np.zeros((len(seed), 3, 4)), seed.copy(), np.zeros(n), np.zeros(n)
    for _ in range(_STEPS_FROM_AFAR):
        for k in range(n):
            drift[k] = centring * (middle[k] - now[k])
        _step(chain, now, goal, drift, frames, change)
        largest = 0.0
        for k in range(n):
            change[k] = min(max(change[k], -_MAX_STEP), _MAX_STEP)
            now[k] += change[k]
            largest = max(largest, abs(change[k]))
        if largest < _ARRIVED:
            break
    for k in range(n):
        if not slides[k] and (now[k] < lower[k] or now[k] > upper[k]):
            now[k] -= _FULL_TURN * np.round((now[k] - middle[k]) / _FULL_TURN)
    return _followed(chain, now, goal, 0.0, 3, frames)


@inner
def _assessed(
    chain: Chain, q: FloatArray, goal: FloatArray, first_low: int, frames: FloatArray
) -> tuple[float, float, float]:
    """Return error, least singular value and lowest height; frames are left as at q."""
    palm, jac, error = np.zeros((3, 4)), np.zeros((6, len(q))), np.zeros(6)
    _joint_frames(chain, q, frames, palm)
    _jacobian(chain, frames, palm, jac)
    _error(palm, goal, error)
    square = np.zeros((6, 6))
    _square(jac, square)
    least = _least_eigenvalue(square)
    points, begins = chain[7], chain[8]
    lowest = np.inf
    for k in range(first_low, len(q)):
        x, y, z, height = frames[k, 2]
        bottom = 0.0
        for i in range(begins[k], begins[k + 1]):
            bottom = min(bottom, points[i, 0] * x + points[i, 1] * y + points[i, 2] * z)
        lowest = min(lowest, height + bottom)
    far = 0.0
    for i in range(6):
        far += error[i] ** 2
    return np.sqrt(far), np.sqrt(max(least, 0.0)), lowest


@compiled
def assess(chain: Chain, q: FloatArray, goal: FloatArray, first_low: int) -> tuple[float, float, float]:
    """Say how well joints, shape (n,), reach a goal, shape (4, 4).

    Args:
        chain: The chain.
        q: The joints.
        goal: Wanted pose of the palm in the base frame.
        first_low: First joint whose link has to stay high.

    Returns:
        How far the palm is from the goal, a radian counting as a metre; the least singular value of the
        Jacobian, m and rad alike; the height of the lowest point of the links from ``first_low`` on.
    """
    return _assessed(chain, q, goal, first_low, np.zeros((len(q), 3, 4)))


@compiled
def followed_path(
    chain: Chain, q: FloatArray, goals: FloatArray, spans_s: FloatArray, rate: float
) -> FloatArray:
    """Return the joints with which poses are followed, as ``comfort_of_path`` does, shape (t, n).

    Args:
        chain: The chain.
        q: Joints at the start, shape (n,).
        goals: Poses of the palm in the base frame, shape (t, 4, 4).
        spans_s: Time since the pose before, shape (t,); 0 for the first.
        rate: Centring rate.
    """
    frames, now = np.zeros((len(q), 3, 4)), q.copy()
    path = np.zeros((len(goals), len(q)))
    for t in range(len(goals)):
        steps = 2 if spans_s[t] > 0.0 else 1
        for _ in range(steps):
            now = _followed(chain, now, goals[t], rate * spans_s[t] / steps, 2, frames)
        path[t] = now
    return path


@compiled
def comfort_of_path(
    chain: Chain,
    q: FloatArray,
    goals: FloatArray,
    spans_s: FloatArray,
    speeds: FloatArray,
    first_low: int,
    rules: FloatArray,
    first_counts: bool,
) -> tuple[float, float, float]:
    """Follow poses and return the comfort of the least comfortable one; 0 when it cannot be done so fast.

    Args:
        chain: The chain.
        q: Joints at the start, shape (n,).
        goals: Poses of the palm in the base frame, shape (t, 4, 4).
        spans_s: Time since the pose before, shape (t,); 0 for the first.
        speeds: Largest speed of each joint between poses, shape (n,).
        first_low: First joint whose link has to stay high.
        rules: Centring rate, largest error, least height, least margin, least and good singular value, and a
            comfort that is of no use any more, shape (7,).
        first_counts: Whether the first joint's range counts.

    Returns:
        The comfort, and the smallest and largest position of the first joint.
    """
    rate, max_error, min_height, min_margin, min_value, good_value, useless = rules
    lower, upper = chain[4], chain[5]
    n = len(q)
    frames = np.zeros((n, 3, 4))
    before, comfort, low, high = q.copy(), np.inf, q[0], q[0]
    for t in range(len(goals)):
        steps = 2 if spans_s[t] > 0.0 else 1
        now = before
        for _ in range(steps):
            now = _followed(chain, now, goals[t], rate * spans_s[t] / steps, 2, frames)
        if spans_s[t] > 0.0:
            for k in range(n):
                if np.abs(now[k] - before[k]) > speeds[k] * spans_s[t]:
                    return 0.0, 0.0, 0.0
        error, value, lowest = _assessed(chain, now, goals[t], first_low, frames)
        margin = np.inf
        for k in range(0 if first_counts else 1, n):
            margin = min(margin, min(now[k] - lower[k], upper[k] - now[k]) / (0.5 * (upper[k] - lower[k])))
        if error > max_error or lowest < min_height or margin < min_margin or value < min_value:
            return 0.0, 0.0, 0.0
        comfort = min(comfort, margin, value / good_value)
        if comfort <= useless:
            return 0.0, 0.0, 0.0
        low, high, before = min(low, now[0]), max(high, now[0]), now
    return comfort, low, high
