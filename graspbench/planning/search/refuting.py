"""Weak directions that are remembered: most grasps are no better than a known ball, for few reasons.

A grasp whose wrenches reach no farther than some floor in one direction has no larger ball. A direction that
refutes one grasp mostly refutes those that share contacts with it, so it is kept with the reach of every
node; a grasp is then refuted by comparing a few numbers. Only what no kept direction refutes is looked at:
a walk to its own weak direction gives the next one.
"""

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.search.polar import weak_direction

KEPT = 96
"""Directions that are kept at a time; the oldest makes room."""


class WeakDirections:
    """Directions in which grasps turned out weak, and how far each node's wrenches reach there.

    Args:
        wrenches: Unit cone wrenches of each node in leaf order, shape (n, n_vertices, d).
    """

    def __init__(self, wrenches: FloatArray) -> None:
        self._wrenches = np.ascontiguousarray(wrenches)
        self._directions = np.zeros((KEPT, wrenches.shape[2]))
        self._reach = np.zeros((len(wrenches), KEPT))
        self._met = np.zeros(1, dtype=np.int64)

    def refuted(self, grasps: IntArray, floor: float) -> BoolArray:
        """Tell which grasps are seen to have no larger ball than a floor, shape (m,).

        Args:
            grasps: Leaves of each, shape (m, n_f).
            floor: Radius of the known ball, positive.
        """
        refuted = np.zeros(len(grasps), dtype=np.bool_)
        _refute(grasps, self._wrenches, self._directions, self._reach, self._met, floor, refuted)
        return refuted


@compiled
def _refute(
    grasps: IntArray,
    wrenches: FloatArray,
    directions: FloatArray,
    reach: FloatArray,
    met: IntArray,
    floor: float,
    refuted: BoolArray,
) -> None:
    """Mark grasps that some direction refutes; keep the directions that were met on the way.

    Args:
        grasps: Shape (m, n_f).
        wrenches: Shape (n, n_vertices, d).
        directions: Kept directions, shape (k, d), in a ring.
        reach: Reach of each node in each of them, shape (n, k).
        met: How many were met so far, shape (1,).
        floor: Positive.
        refuted: Written, shape (m,).
    """
    n_f = grasps.shape[1]
    _, n_v, d = wrenches.shape
    kept = reach.shape[1]
    grasp, direction = np.empty((n_f * n_v, d)), np.empty(d)
    for m in range(grasps.shape[0]):
        many = min(met[0], kept)
        lowest, weakest = np.inf, -1
        for j in range(many):
            farthest = reach[grasps[m, 0], j]
            for i in range(1, n_f):
                farthest = max(farthest, reach[grasps[m, i], j])
            if farthest < lowest:
                lowest, weakest = farthest, j
                if lowest <= floor:
                    break
        if lowest <= floor:
            refuted[m] = True
            continue
        for i in range(n_f):
            for v in range(n_v):
                for k in range(d):
                    grasp[i * n_v + v, k] = wrenches[grasps[m, i], v, k]
        if weakest >= 0:
            for k in range(d):
                direction[k] = directions[weakest, k]
        elif not _middle(grasp, direction):
            continue
        weak_direction(grasp, n_f * n_v, direction)
        if _farthest(grasp, direction) > floor:
            continue
        refuted[m] = True
        slot = met[0] % kept
        met[0] += 1
        for k in range(d):
            directions[slot, k] = direction[k]
        for node in range(wrenches.shape[0]):
            reach[node, slot] = _farthest(wrenches[node], direction)


@inner
def _middle(grasp: FloatArray, direction: FloatArray) -> bool:
    """Write the direction in which the wrenches reach on average; False where there is none."""
    m, d = grasp.shape
    square = 0.0
    for k in range(d):
        direction[k] = 0.0
        for j in range(m):
            direction[k] += grasp[j, k]
        square += direction[k] * direction[k]
    if square == 0.0:
        return False
    for k in range(d):
        direction[k] /= np.sqrt(square)
    return True


@inner
def _farthest(wrenches: FloatArray, direction: FloatArray) -> float:
    """Return the support of some wrenches, shape (m, d)."""
    farthest = -np.inf
    for j in range(wrenches.shape[0]):
        value = 0.0
        for k in range(wrenches.shape[1]):
            value += wrenches[j, k] * direction[k]
        farthest = max(farthest, value)
    return farthest
