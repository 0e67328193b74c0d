"""One step of the placement of a hand: solved for, and applied to wrist pose and joints. Compiled."""

import math

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.hand.chains import LEADER, LEADER_FINGER, LOWER, OFFSET, RATIO, UPPER, Chains
from graspbench.hand.task import System


@inner
def is_leader(chains: Chains, f: int, j: int) -> bool:
    """Tell whether a joint follows no other."""
    own: bool = chains.kinds[f, j, LEADER_FINGER] == f and chains.kinds[f, j, LEADER] == j
    return own


@inner
def leads(chains: Chains, f: int, j: int, contact_of: IntArray) -> bool:
    """Tell whether a joint moves, by one that follows it, a finger that has a contact."""
    for g in range(contact_of.size):
        for m in range(chains.counts[g]):
            led = chains.kinds[g, m, LEADER_FINGER] == f and chains.kinds[g, m, LEADER] == j
            if contact_of[g] >= 0 and led:
                return True
    return False


@inner
def solve_step(system: System, damping: float) -> bool:
    """Solve (H + damping diag) step = gradient by Cholesky, frozen entries zero; False if that fails."""
    h, step, frozen = system.factor, system.step, system.frozen
    size = step.size
    for i in range(size):
        step[i] = 0.0 if frozen[i] > 0.0 else system.best_gradient[i]
        for j in range(i + 1):
            h[i, j] = 0.0 if frozen[i] + frozen[j] > 0.0 else system.best_hessian[i, j]
        h[i, i] = 1.0 if frozen[i] > 0.0 else h[i, i] + damping * (h[i, i] + 1.0)
    for i in range(size):
        for j in range(i + 1):
            total = h[i, j]
            for m in range(j):
                total -= h[i, m] * h[j, m]
            if i > j:
                h[i, j] = total / h[j, j]
            elif total > 0.0:
                h[i, i] = math.sqrt(total)
            else:
                return False
    for i in range(size):
        for m in range(i):
            step[i] -= h[i, m] * step[m]
        step[i] /= h[i, i]
    for i in range(size - 1, -1, -1):
        for m in range(i + 1, size):
            step[i] -= h[m, i] * step[m]
        step[i] /= h[i, i]
    return True


@inner
def move_hand(chains: Chains, pose: FloatArray, joints: FloatArray, step: FloatArray) -> None:
    """Apply a step: a twist in the palm frame, and joints kept within their limits."""
    n, k = joints.shape
    x, y, z = step[3], step[4], step[5]
    length = math.sqrt(x * x + y * y + z * z)
    for i in range(3):
        pose[i, 3] += pose[i, 0] * step[0] + pose[i, 1] * step[1] + pose[i, 2] * step[2]
    if length > 1e-12:
        x, y, z = x / length, y / length, z / length
        angle = min(length, 0.5)
        c, s = math.cos(angle), math.sin(angle)
        u = 1.0 - c
        for i in range(3):
            a, b, d = pose[i, 0], pose[i, 1], pose[i, 2]
            pose[i, 0] = a * (c + u * x * x) + b * (u * x * y + s * z) + d * (u * x * z - s * y)
            pose[i, 1] = a * (u * x * y - s * z) + b * (c + u * y * y) + d * (u * y * z + s * x)
            pose[i, 2] = a * (u * x * z + s * y) + b * (u * y * z - s * x) + d * (c + u * z * z)
    for f in range(n):
        for j in range(chains.counts[f]):
            value = joints[f, j] + min(0.6, max(-0.6, step[6 + f * k + j]))
            joints[f, j] = min(chains.limits[f, j, UPPER], max(chains.limits[f, j, LOWER], value))
    for f in range(n):
        for j in range(chains.counts[f]):
            if not is_leader(chains, f, j):
                led = joints[chains.kinds[f, j, LEADER_FINGER], chains.kinds[f, j, LEADER]]
                joints[f, j] = chains.limits[f, j, RATIO] * led + chains.limits[f, j, OFFSET]


@inner
def copy_matrix(source: FloatArray, target: FloatArray) -> None:
    """Copy a matrix into another one of its shape."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]
