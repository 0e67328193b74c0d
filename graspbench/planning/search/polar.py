"""A fast walk to a weak direction of a grasp: an upper bound of its ball radius.

The support function's smallest value over unit directions is one over the largest norm in the polar
polytope {x : w_j . x <= 1}. The walk goes from a given direction to a vertex of that polytope and from
vertex to vertex as long as the norm grows, like the simplex method. It ends in a local optimum, which is
all that a bound needs.
"""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import inner

MAX_STEPS = 18


@inner
def weak_direction(wrenches: FloatArray, m: int, direction: FloatArray) -> None:
    """Turn ``direction`` towards a weaker one.

    Args:
        wrenches: Unit cone wrenches of one grasp in the first rows, shape (>= m, d).
        m: Number of wrenches.
        direction: Unit direction with positive support, shape (d,); overwritten. If the grasp is seen
            not to be force closure, its support is not positive afterwards.
    """
    d = wrenches.shape[1]
    x = np.empty(d)
    slack = np.empty(m)
    edges = np.zeros((d, d))  # column i leaves constraint i and keeps the others
    real = np.zeros(d, np.bool_)  # at first the constraints are coordinate planes, free to leave
    height = 0.0
    for j in range(m):
        slack[j] = 0.0
        for k in range(d):
            slack[j] += wrenches[j, k] * direction[k]
        height = max(height, slack[j])
    if height <= 0.0:
        return
    norm = 0.0
    for k in range(d):
        x[k] = direction[k] / height
        norm += x[k] * x[k]
        edges[k, k] = 1.0
    for j in range(m):
        slack[j] = 1.0 - slack[j] / height

    step = np.empty(d)
    move = np.empty(d)
    count = 0
    for _ in range(MAX_STEPS):
        largest, leave, enter = norm * (1.0 + 1e-9) if count == d else -1.0, -1, -1
        for i in range(d):
            if count < d and real[i]:
                continue
            along, square = 0.0, 0.0
            for k in range(d):
                along += edges[k, i] * x[k]
                square += edges[k, i] * edges[k, i]
            sign = 1.0 if not real[i] and along >= 0.0 else -1.0
            for k in range(d):
                step[k] = sign * edges[k, i]
            length, block = np.inf, -1
            for j in range(m):
                rate = 0.0
                for k in range(d):
                    rate += wrenches[j, k] * step[k]
                if rate > 1e-10 and slack[j] < length * rate:
                    length, block = max(slack[j], 0.0) / rate, j
            if block < 0:  # nothing blocks: this direction has no positive support
                for k in range(d):
                    direction[k] = step[k] / np.sqrt(square)
                return
            # A long edge may go downhill first and still end higher: judge by its far end.
            reached = norm + 2.0 * length * sign * along + length * length * square
            if reached > largest:
                largest, leave, enter = reached, i, block
                for k in range(d):
                    move[k] = length * step[k]
        if leave < 0:
            break
        count += not real[leave]
        real[leave] = True
        norm = 0.0
        for k in range(d):
            x[k] += move[k]
            norm += x[k] * x[k]
        for j in range(m):
            slack[j] = 1.0
            for k in range(d):
                slack[j] -= wrenches[j, k] * x[k]
        # The new constraint replaces the one that was left: one elimination step on the edges.
        pivot = 0.0
        for k in range(d):
            pivot += wrenches[enter, k] * edges[k, leave]
        for k in range(d):
            edges[k, leave] /= pivot
        for i in range(d):
            if i != leave:
                share = 0.0
                for k in range(d):
                    share += wrenches[enter, k] * edges[k, i]
                for k in range(d):
                    edges[k, i] -= share * edges[k, leave]
    if norm < 1e24:
        for k in range(d):
            direction[k] = x[k] / np.sqrt(norm)
