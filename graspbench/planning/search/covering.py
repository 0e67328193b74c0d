"""All grasps of a few small clusters at once, for Q3.

A grasp is better than a known one only if in every direction some contact's cone wrenches reach farther
than the known ball. So each member is given one bit per direction: whether it reaches. A grasp stands as
long as the bits of its members cover all directions; to refute one that does, a walk to its weak direction
gives a further direction, which mostly refutes its neighbours as well.
"""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.search.polar import weak_direction

MAX_DIRECTIONS = 62
"""Bits of a signed integer that are used."""

MAX_FROM_TABLE, WEAK = 24, 1.3
"""Directions that are taken from a table, and how little is reached there, in balls."""


@compiled
def standing_grasps(
    tuples: IntArray,
    tree: IntArray,
    wrenches: FloatArray,
    table: FloatArray,
    directions: FloatArray,
    floor: float,
    grasps: IntArray,
    bounds: FloatArray,
) -> tuple[int, int]:
    """List the grasps of tuples of clusters that may have a larger ball than a known one.

    Args:
        tuples: Clusters of each tuple, shape (m, n_f), equal ones side by side.
        tree: Children, first member and end of each cluster, shape (n_clusters, 4).
        wrenches: Unit cone wrenches in leaf order, shape (n, n_vertices, d).
        table: Support of each cluster in each direction, shape (n_clusters, n_directions).
        directions: Shape (n_directions, d).
        floor: Radius of the known ball; not negative.
        grasps: Written: leaves of each grasp, shape (at least the grasps of any one tuple, n_f).
        bounds: Written: upper bound of each grasp's ball, shape (same,).

    Returns:
        How many tuples were finished before the lists were full, and how many grasps are listed.
    """
    n_f = tuples.shape[1]
    _, n_v, d = wrenches.shape
    largest = 0
    for m in range(tuples.shape[0]):
        for i in range(n_f):
            largest = max(largest, tree[tuples[m, i], 3] - tree[tuples[m, i], 2])
    bits = np.empty((n_f, largest), np.int64)
    union = np.empty(n_f + 1, np.int64)
    first, count = np.empty(n_f, np.int64), np.empty(n_f, np.int64)
    chosen = np.empty(n_f, np.int64)
    covered = np.zeros(n_f + 1, np.int64)
    grasp = np.empty((n_f * n_v, d))
    known, direction = np.empty((MAX_DIRECTIONS, d)), np.empty(d)
    found = 0
    for m in range(tuples.shape[0]):
        room = 1
        for i in range(n_f):
            first[i], count[i] = tree[tuples[m, i], 2], tree[tuples[m, i], 3] - tree[tuples[m, i], 2]
            room *= count[i]
        if found + room > grasps.shape[0]:
            return m, found
        many = _weak_ones(tuples, m, table, directions, floor, known)
        for i in range(n_f):
            for a in range(count[i]):
                bits[i, a] = 0
        for j in range(many):
            _mark(bits, first, count, wrenches, known, j, floor)
        every = _unite(bits, count, union, many)
        if union[0] != every:
            continue
        depth = 0
        chosen[0] = -1
        while depth >= 0:
            chosen[depth] += 1
            if chosen[depth] >= count[depth]:
                depth -= 1
                continue
            covered[depth + 1] = covered[depth] | bits[depth, chosen[depth]]
            if covered[depth + 1] | union[depth + 1] != every:
                continue
            if depth + 1 < n_f:
                depth += 1
                # Contacts of one cluster are in order, or grasps would be listed again.
                chosen[depth] = chosen[depth - 1] if tuples[m, depth] == tuples[m, depth - 1] else -1
                continue
            for i in range(n_f):
                for v in range(n_v):
                    for k in range(d):
                        grasp[i * n_v + v, k] = wrenches[first[i] + chosen[i], v, k]
            reach = _walk(grasp, known, many, direction, floor)
            if reach > floor:
                for i in range(n_f):
                    grasps[found, i] = first[i] + chosen[i]
                bounds[found] = reach
                found += 1
            elif many < MAX_DIRECTIONS:
                for k in range(d):
                    known[many, k] = direction[k]
                _mark(bits, first, count, wrenches, known, many, floor)
                many += 1
                every = _unite(bits, count, union, many)
                if union[0] != every:
                    break
                # What was chosen before may no longer be able to cover: go back to there.
                depth = 0
                while depth < n_f - 1:
                    covered[depth + 1] = covered[depth] | bits[depth, chosen[depth]]
                    if covered[depth + 1] | union[depth + 1] != every:
                        break
                    depth += 1
    return tuples.shape[0], found


@inner
def _weak_ones(
    tuples: IntArray, m: int, table: FloatArray, directions: FloatArray, floor: float, known: FloatArray
) -> int:
    """Collect directions of the table in which the clusters reach little farther than the floor."""
    many = 0
    for j in range(table.shape[1]):
        reach = table[tuples[m, 0], j]
        for i in range(1, tuples.shape[1]):
            reach = max(reach, table[tuples[m, i], j])
        if reach < WEAK * floor:
            for k in range(directions.shape[1]):
                known[many, k] = directions[j, k]
            many += 1
            if many == MAX_FROM_TABLE:
                break
    return many


@inner
def _unite(bits: IntArray, count: IntArray, union: IntArray, many: int) -> int:
    """Write what the members of each contact and the following ones cover; return all bits in use."""
    union[count.shape[0]] = 0
    for i in range(count.shape[0] - 1, -1, -1):
        union[i] = union[i + 1]
        for a in range(count[i]):
            union[i] |= bits[i, a]
    return int((np.int64(1) << many) - 1)


@inner
def _walk(grasp: FloatArray, known: FloatArray, many: int, direction: FloatArray, floor: float) -> float:
    """Write a weak direction of a grasp, and return how far it reaches there."""
    m, d = grasp.shape
    lowest, weakest = np.inf, 0
    # First from the weakest known direction, then from one that is surely reached.
    for attempt in range(2):
        if attempt == 0:
            for j in range(many):
                reach = _reach(grasp, known, j)
                if reach < lowest:
                    lowest, weakest = reach, j
            for k in range(d):
                direction[k] = known[weakest, k]
            if many == 0:
                continue
        else:
            size = 0.0
            for k in range(d):
                direction[k] = 0.0
                for j in range(m):
                    direction[k] += grasp[j, k]
                size += direction[k] * direction[k]
            for k in range(d):
                direction[k] /= np.sqrt(size)
        weak_direction(grasp, m, direction)
        reach = -np.inf
        for j in range(m):
            value = 0.0
            for k in range(d):
                value += grasp[j, k] * direction[k]
            reach = max(reach, value)
        lowest = min(lowest, reach)
        if lowest <= floor:
            break
    return lowest


@inner
def _reach(grasp: FloatArray, known: FloatArray, j: int) -> float:
    farthest = -np.inf
    for c in range(grasp.shape[0]):
        value = 0.0
        for k in range(grasp.shape[1]):
            value += grasp[c, k] * known[j, k]
        farthest = max(farthest, value)
    return farthest


@inner
def _mark(
    bits: IntArray,
    first: IntArray,
    count: IntArray,
    wrenches: FloatArray,
    known: FloatArray,
    j: int,
    floor: float,
) -> None:
    """Set bit j of every member that reaches farther than the floor in known direction j."""
    _, n_v, d = wrenches.shape
    for i in range(first.shape[0]):
        for a in range(count[i]):
            for v in range(n_v):
                value = 0.0
                for k in range(d):
                    value += wrenches[first[i] + a, v, k] * known[j, k]
                if value > floor:
                    bits[i, a] |= np.int64(1) << j
                    break
