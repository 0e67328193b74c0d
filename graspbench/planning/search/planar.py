"""Upper bounds for the planar wrench spaces, which depend on each grasp's plane.

All grasps of a tuple of clusters have planes within some angle of one plane, which follows from how far their
contacts can be from the clusters' centres. The least rotation from that plane to a grasp's own turns the
grasp's wrenches into those that its contacts, turned back by as much, have in the fixed plane. So it is
enough to measure in the fixed plane, and to add what turning each normal and each arm by the angle can
change. Then the tests are those of `graspbench.planning.search.bounds`: a sum or a maximum over the contacts.
"""

import math
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.planning.search.bounds import Q1, Q2, Q3, inverse, member, within_limits
from graspbench.planning.search.polar import weak_direction

POWERS = 5
"""Powers of the inverse that are tried for Q1: 1, 2, 4, ..."""

WALKS = 2
"""Directions of the table from which a weak one is looked for."""


@compiled
def bound_planar(
    tuples: IntArray,
    bounds: FloatArray,
    tree: IntArray,
    balls: FloatArray,
    caps: FloatArray,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    measure: int,
    minkowski: bool,
    limits: FloatArray,
    lower: float,
) -> None:
    """Lower the bounds of tuples of clusters; to -inf where no grasp is force closure within the limits.

    Args:
        tuples: Clusters of each tuple, shape (m, n_f).
        bounds: Known upper bounds, shape (m,); overwritten.
        tree: Children, first member and end of each cluster, shape (n_clusters, 4).
        balls: Centre and radius of each cluster's arms, shape (n_clusters, 4).
        caps: Largest trace of any member's share of G G^T, shape (n_clusters,).
        arms: From the centroid, in torque lengths, in leaf order, shape (n, 3).
        normals: Inward unit normals in leaf order, shape (n, 3).
        vertices: Corners of the contact polytope, shape (n_v, n_basis).
        directions: Unit directions of the wrench space, shape (n_directions, d).
        measure: Q1, Q2 or Q3.
        minkowski: Q3 is that of the Minkowski sum.
        limits: Largest distance of two contacts, and of their mean from the centroid, torque lengths.
        lower: A bound at or below this need not be exact.
    """
    n_f, d = tuples.shape[1], directions.shape[1]
    clusters = np.empty(n_f, np.int64)
    frame, centres = np.empty((3, 3)), np.empty((n_f, 3))
    wrenches = np.empty((n_f * vertices.shape[0], d))
    for m in range(tuples.shape[0]):
        error, total = 0.0, 0.0
        for i in range(n_f):
            clusters[i] = tuples[m, i]
            error += balls[clusters[i], 3] ** 2
            total += caps[clusters[i]]
            for k in range(3):
                centres[i, k] = balls[clusters[i], k]
        if not within_limits(clusters, balls, limits):
            bounds[m] = -np.inf
            continue
        turn = _plane(centres, math.sqrt(error), frame)
        for i in range(n_f):
            node = member(tree, clusters, i)
            _contact_wrenches(frame, normals[node], arms[node], vertices, wrenches, i)
        floor = max(lower, 0.0) if measure == Q3 else 0.0
        support = _support_bound(
            clusters, tree, frame, turn, arms, normals, vertices, directions, wrenches, minkowski, floor
        )
        if support <= floor:
            bounds[m] = -np.inf
        elif measure == Q3:
            bounds[m] = min(bounds[m], support * (1.0 + 1e-9))
        else:
            cap = math.sqrt(total / d) if measure == Q1 else (total / d) ** (0.5 * d)
            bounds[m] = min(bounds[m], cap * (1.0 + 1e-9))
            if bounds[m] > lower:
                bounds[m] = _singular_bound(
                    clusters,
                    tree,
                    frame,
                    turn,
                    arms,
                    normals,
                    vertices.shape[1],
                    d,
                    measure,
                    lower,
                    bounds[m],
                )


@compiled
def planar_grasps(
    tuples: IntArray,
    tree: IntArray,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    measure: int,
    minkowski: bool,
    lower: float,
    grasps: IntArray,
    bounds: FloatArray,
) -> tuple[int, int]:
    """List the single grasps of tuples of clusters that may be better than a known one.

    Args:
        tuples: Clusters of each tuple, shape (m, n_f), equal ones side by side.
        tree: See `bound_planar`, as what follows.
        arms: Shape (n, 3).
        normals: Shape (n, 3).
        vertices: Shape (n_v, n_basis).
        directions: Shape (n_directions, d).
        measure: Q1, Q2 or Q3.
        minkowski: Q3 is that of the Minkowski sum.
        lower: The known value.
        grasps: Written: leaves of each grasp, shape (at least the grasps of any one tuple, n_f).
        bounds: Written: upper bound of each grasp's value, shape (same,).

    Returns:
        How many tuples were finished before the lists were full, and how many grasps are listed.
    """
    n_f, d, n_v = tuples.shape[1], directions.shape[1], vertices.shape[0]
    chosen = np.empty(n_f, np.int64)
    frame, wrenches, gram = np.empty((3, 3)), np.empty((n_f * n_v, d)), np.empty((d, d))
    found = 0
    for m in range(tuples.shape[0]):
        room = 1
        for i in range(n_f):
            room *= tree[tuples[m, i], 3] - tree[tuples[m, i], 2]
        if found + room > grasps.shape[0]:
            return m, found
        depth = 0
        chosen[0] = tree[tuples[m, 0], 2] - 1
        while depth >= 0:
            chosen[depth] += 1
            if chosen[depth] >= tree[tuples[m, depth], 3]:
                depth -= 1
                continue
            if depth + 1 < n_f:
                depth += 1
                same = tuples[m, depth] == tuples[m, depth - 1]
                chosen[depth] = chosen[depth - 1] if same else tree[tuples[m, depth], 2] - 1
                continue
            value = _promise(
                chosen, arms, normals, vertices, directions, measure, minkowski, lower, frame, wrenches, gram
            )
            if value > max(lower, 0.0):
                for i in range(n_f):
                    grasps[found, i] = chosen[i]
                bounds[found] = value
                found += 1
    return tuples.shape[0], found


@compiled
def planar_promise(
    grasps: IntArray,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    measure: int,
    minkowski: bool,
    lower: float,
    promised: FloatArray,
) -> None:
    """Write upper bounds of single grasps' values, shape (m,); grasps are leaves, shape (m, n_f)."""
    n_f, d, n_v = grasps.shape[1], directions.shape[1], vertices.shape[0]
    chosen = np.empty(n_f, np.int64)
    frame, wrenches, gram = np.empty((3, 3)), np.empty((n_f * n_v, d)), np.empty((d, d))
    for m in range(grasps.shape[0]):
        for i in range(n_f):
            chosen[i] = grasps[m, i]
        promised[m] = _promise(
            chosen, arms, normals, vertices, directions, measure, minkowski, lower, frame, wrenches, gram
        )


@inner
def _promise(
    chosen: IntArray,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    measure: int,
    minkowski: bool,
    lower: float,
    frame: FloatArray,
    wrenches: FloatArray,
    gram: FloatArray,
) -> float:
    """Return an upper bound of a single grasp's value; not positive where it is not force closure."""
    n_f, d = chosen.shape[0], directions.shape[1]
    points = np.empty((n_f, 3))
    for i in range(n_f):
        for k in range(3):
            points[i, k] = arms[chosen[i], k]
    value = np.inf
    if _plane(points, 1e-9, frame) > 1e-3:
        return value  # its plane depends on its normals, or on rounding
    if measure != Q3:
        value = _singular(chosen, frame, arms, normals, vertices.shape[1], d, measure, gram)
        if value <= lower:
            return value
    edges = vertices.shape[0] // 2 if vertices.shape[1] == 4 else vertices.shape[0]
    if edges % 2 == 1 and vertices.shape[1] > 1:
        return value + 1e-7 * abs(value)  # the first edge of an odd pyramid depends on the plane's sign
    for i in range(n_f):
        _contact_wrenches(frame, normals[chosen[i]], arms[chosen[i]], vertices, wrenches, i)
    reach = _least_support(wrenches, n_f, directions, minkowski, max(lower, 0.0) if measure == Q3 else 0.0)
    if measure == Q3 or reach <= 0.0:
        value = reach
    return value + 1e-7 * abs(value)


@inner
def _plane(points: FloatArray, error: float, frame: FloatArray) -> float:
    """Write the least squares plane of contacts, and return how far planes of near contacts turn from it.

    Args:
        points: Shape (n_f, 3).
        error: Root of the summed squares of how far the contacts may be from the points.
        frame: Written: two unit vectors in the plane, and its normal, shape (3, 3).

    Returns:
        Chord of the largest angle, at most the square root of two: the normal's sign is of no meaning.
    """
    n_f = points.shape[0]
    if n_f == 3:
        return _plane_of_three(points, error, frame)
    spread = np.zeros((3, 3))
    for i in range(n_f):
        for j in range(i):
            for a in range(3):
                for b in range(3):
                    gap = (points[i, a] - points[j, a]) * (points[i, b] - points[j, b])
                    spread[a, b] += gap / n_f
    values, vectors = np.linalg.eigh(spread)
    for k in range(3):
        for j in range(3):
            frame[j, k] = vectors[k, 2 - j]
    least, second = math.sqrt(max(values[0], 0.0)), math.sqrt(max(values[1], 0.0))
    if n_f == 2 or second <= 1e-6 * math.sqrt(max(values[2], 1e-300)):
        return math.sqrt(2.0)
    widest = second * second - least * least
    return _chord(math.sqrt((4.0 * error * least + 4.0 * error * error) / max(widest, 1e-300)))


@inner
def _plane_of_three(points: FloatArray, error: float, frame: FloatArray) -> float:
    """See `_plane`; three contacts lie in their plane, so their spread out of it is error alone."""
    longest, size, total = 0.0, 0.0, 0.0
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        first, second = points[1, k] - points[0, k], points[2, k] - points[0, k]
        frame[0, k] = first
        longest += first * first
        total += (first * first + second * second + (first - second) ** 2) / 3.0
        frame[2, k] = (points[1, a] - points[0, a]) * (points[2, b] - points[0, b])
        frame[2, k] -= (points[1, b] - points[0, b]) * (points[2, a] - points[0, a])
        size += frame[2, k] ** 2
    longest, size = math.sqrt(longest), math.sqrt(size)
    second = 0.5 * total - math.sqrt(max(0.25 * total * total - size * size / 3.0, 0.0))
    if size <= 1e-7 * total or longest <= 1e-9:
        frame[:] = np.eye(3)
        return math.sqrt(2.0)
    for k in range(3):
        frame[0, k] /= longest
        frame[2, k] /= size
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        frame[1, k] = frame[2, a] * frame[0, b] - frame[2, b] * frame[0, a]
    return _chord(error / math.sqrt(max(second, 1e-300)))


@inner
def _chord(sine: float) -> float:
    """Return the chord of the angle of a sine; of a right angle from one on."""
    return 2.0 * math.sin(0.5 * math.asin(sine)) if sine < 1.0 else math.sqrt(2.0)


@inner
def _contact_wrenches(
    frame: FloatArray, normal: FloatArray, arm: FloatArray, vertices: FloatArray, wrenches: FloatArray, i: int
) -> None:
    """Write the wrenches of contact i's corners in the plane of a frame."""
    basis = np.empty((3, 3))
    frictionless = vertices.shape[1] == 1
    for v in range(vertices.shape[0]):
        if frictionless:
            _wrench(frame, normal, arm, 0.0, wrenches[i])
            continue
        if v == 0:
            _basis(frame, normal, basis)
        force = np.empty(3)
        for k in range(3):
            force[k] = 0.0
            for j in range(3):
                force[k] += vertices[v, j] * basis[j, k]
        twist = 0.0
        if vertices.shape[1] == 4:
            for k in range(3):
                twist += vertices[v, 3] * frame[2, k] * normal[k]
        _wrench(frame, force, arm, twist, wrenches[i * vertices.shape[0] + v])


@inner
def _wrench(frame: FloatArray, force: FloatArray, arm: FloatArray, twist: float, out: FloatArray) -> None:
    """Write a force's components in the plane and, if there is room, its moment about the plane's normal."""
    for j in range(2):
        out[j] = 0.0
        for k in range(3):
            out[j] += frame[j, k] * force[k]
    if out.shape[0] == 3:
        out[2] = twist
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            out[2] += frame[2, k] * (arm[a] * force[b] - arm[b] * force[a])


@inner
def _basis(frame: FloatArray, normal: FloatArray, basis: FloatArray) -> float:
    """Write a contact's tangent in the plane, the other one and the normal; return the plane's sine."""
    square = 0.0
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        basis[0, k] = frame[2, a] * normal[b] - frame[2, b] * normal[a]
        square += basis[0, k] ** 2
        basis[2, k] = normal[k]
    sine = math.sqrt(square)
    for k in range(3):
        basis[0, k] = basis[0, k] / sine if sine > 1e-6 else frame[0, k]
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        basis[1, k] = normal[a] * basis[0, b] - normal[b] * basis[0, a]
    return sine


@inner
def _support(
    frame: FloatArray,
    turn: float,
    normal: FloatArray,
    arm: FloatArray,
    vertices: FloatArray,
    direction: FloatArray,
) -> float:
    """Return no less than the support of a contact whose normal and arm may be turned by as much as ``turn``.

    A wrench's product with the direction is that of its force with g, the direction's own force plus its
    moment's turn at the arm. Turned normals have turned corners, and all of them are in the circular cone.
    """
    d = direction.shape[0]
    g = np.empty(3)
    moment = direction[2] if d == 3 else 0.0
    square, along, reach, tilt = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        g[k] = direction[0] * frame[0, k] + direction[1] * frame[1, k]
        g[k] += moment * (frame[2, a] * arm[b] - frame[2, b] * arm[a])
        square += g[k] * g[k]
        along += g[k] * normal[k]
        reach += arm[k] * arm[k]
        tilt += frame[2, k] * normal[k]
    size, reach = math.sqrt(square), math.sqrt(reach)
    if vertices.shape[1] == 1:
        return float(along + turn * (size + abs(moment) * reach))
    friction, twist = 0.0, 0.0
    for v in range(vertices.shape[0]):
        friction = max(friction, math.hypot(vertices[v, 0], vertices[v, 1]))
        if vertices.shape[1] == 4:
            twist = max(twist, abs(vertices[v, 3] * moment))
    longest = math.sqrt(1.0 + friction * friction)
    across = math.sqrt(max(square - along * along, 0.0))
    cone = along + friction * across + turn * longest * (size + abs(moment) * reach)
    cone += twist * (abs(tilt) + turn)
    edges = vertices.shape[0] // 2 if vertices.shape[1] == 4 else vertices.shape[0]
    basis = np.empty((3, 3))
    sine = _basis(frame, normal, basis)
    if edges % 2 == 1 or sine <= max(1e-3, 4.0 * turn):
        return float(cone)  # which way the first edge points is not known well enough
    corners = -np.inf
    for v in range(vertices.shape[0]):
        value = 0.0
        for j in range(3):
            for k in range(3):
                value += vertices[v, j] * basis[j, k] * g[k]
        if vertices.shape[1] == 4:
            value += vertices[v, 3] * moment * tilt
        corners = max(corners, value)
    swing = turn + friction * (turn + 3.0 * turn / sine)
    corners += swing * size + turn * longest * abs(moment) * reach + twist * turn
    return float(min(cone, corners))


@inner
def _support_bound(
    clusters: IntArray,
    tree: IntArray,
    frame: FloatArray,
    turn: float,
    arms: FloatArray,
    normals: FloatArray,
    vertices: FloatArray,
    directions: FloatArray,
    wrenches: FloatArray,
    minkowski: bool,
    floor: float,
) -> float:
    """Return an upper bound of Q3, from directions in which the representative's wrenches are weak."""
    n_f, d = clusters.shape[0], directions.shape[1]
    direction, best, last = np.empty(d), np.inf, -1
    for walk in range(WALKS + 1):
        lowest, weakest = np.inf, -1
        if walk < WALKS:
            for j in range(directions.shape[0]):
                reach = _reach(wrenches, n_f, directions[j], minkowski)
                near = 0.0
                if last >= 0:
                    for k in range(d):
                        near += directions[j, k] * directions[last, k]
                if reach < lowest and near < 0.7:
                    lowest, weakest = reach, j
            if weakest < 0:
                continue
            for k in range(d):
                direction[k] = directions[weakest, k]
            last = weakest
            if not minkowski and lowest > 0.0:
                weak_direction(wrenches, wrenches.shape[0], direction)
        else:  # where the contacts push together
            square = 0.0
            for k in range(d):
                direction[k] = 0.0
                for j in range(wrenches.shape[0]):
                    direction[k] += wrenches[j, k]
                square += direction[k] ** 2
            if square < 1e-20:
                continue
            for k in range(d):
                direction[k] /= -math.sqrt(square)
        value = 0.0 if minkowski else -np.inf
        for i in range(n_f):
            largest = -np.inf
            for node in range(tree[clusters[i], 2], tree[clusters[i], 3]):
                largest = max(largest, _support(frame, turn, normals[node], arms[node], vertices, direction))
            value = value + max(largest, 0.0) if minkowski else max(value, largest)
        best = min(best, value)
        if best <= floor:
            break
    return best


@inner
def _reach(wrenches: FloatArray, n_f: int, direction: FloatArray, minkowski: bool) -> float:
    """Return the support of single contacts' wrenches in a direction."""
    n_v = wrenches.shape[0] // n_f
    total = 0.0 if minkowski else -np.inf
    for i in range(n_f):
        farthest = -np.inf
        for v in range(i * n_v, (i + 1) * n_v):
            value = 0.0
            for k in range(direction.shape[0]):
                value += wrenches[v, k] * direction[k]
            farthest = max(farthest, value)
        total = total + max(farthest, 0.0) if minkowski else max(total, farthest)
    return float(total)


@inner
def _least_support(
    wrenches: FloatArray, n_f: int, directions: FloatArray, minkowski: bool, floor: float
) -> float:
    """Return an upper bound of a single grasp's Q3."""
    lowest, weakest = np.inf, 0
    for j in range(directions.shape[0]):
        reach = _reach(wrenches, n_f, directions[j], minkowski)
        if reach < lowest:
            lowest, weakest = reach, j
            if lowest <= floor:
                return float(lowest)
    if not minkowski and lowest > 0.0:
        direction = directions[weakest].copy()
        weak_direction(wrenches, wrenches.shape[0], direction)
        lowest = min(lowest, _reach(wrenches, n_f, direction, minkowski))
    return float(lowest)


@inner
def _add_gram(frame: FloatArray, normal: FloatArray, arm: FloatArray, n_basis: int, gram: FloatArray) -> None:
    """Add a contact's share to G G^T in the plane of a frame."""
    d = gram.shape[0]
    column, force = np.empty(d), np.empty(3)
    for c in range(n_basis):
        twist = 0.0
        for k in range(3):
            # With friction any three directions across each other are as good as the tangents and the normal.
            force[k] = normal[k] if n_basis == 1 else frame[c, k] if c < 3 else 0.0
            twist += normal[k] * frame[2, k] if c == 3 else 0.0
        _wrench(frame, force, arm, twist, column)
        for a in range(d):
            for b in range(d):
                gram[a, b] += column[a] * column[b]


@inner
def _singular(
    chosen: IntArray,
    frame: FloatArray,
    arms: FloatArray,
    normals: FloatArray,
    n_basis: int,
    d: int,
    measure: int,
    gram: FloatArray,
) -> float:
    """Return Q1 or Q2 of a grasp."""
    gram[:] = 0.0
    for i in range(chosen.shape[0]):
        _add_gram(frame, normals[chosen[i]], arms[chosen[i]], n_basis, gram)
    if d == 2:
        mean = 0.5 * (gram[0, 0] + gram[1, 1])
        gap = math.hypot(0.5 * (gram[0, 0] - gram[1, 1]), gram[0, 1])
        if measure == Q1:
            return math.sqrt(max(mean - gap, 0.0))
        return math.sqrt(max(gram[0, 0] * gram[1, 1] - gram[0, 1] ** 2, 0.0))
    values = np.linalg.eigvalsh(gram)
    if measure == Q1:
        return math.sqrt(max(values[0], 0.0))
    return math.sqrt(max(values[0] * values[1] * values[2], 0.0))


@inner
def _singular_bound(
    clusters: IntArray,
    tree: IntArray,
    frame: FloatArray,
    turn: float,
    arms: FloatArray,
    normals: FloatArray,
    n_basis: int,
    d: int,
    measure: int,
    lower: float,
    bound: float,
) -> float:
    """Return an upper bound of Q1 or Q2 by tests that come from powers of a representative's inverse."""
    gram = np.zeros((d, d))
    for i in range(clusters.shape[0]):
        node = member(tree, clusters, i)
        _add_gram(frame, normals[node], arms[node], n_basis, gram)
    trace = 0.0
    for a in range(d):
        trace += gram[a, a]
    factor: Any = np.linalg.cholesky(gram + 1e-6 * trace * np.eye(d))
    root = 1.0
    for a in range(d):
        root *= factor[a, a]
    test = inverse(factor)
    square, share = np.empty((d, d)), np.empty((d, d))
    for _ in range(1 if measure == Q2 else POWERS):
        trace, norm = 0.0, 0.0
        for a in range(d):
            trace += test[a, a]
        for a in range(d):
            for b in range(d):
                test[a, b] = test[a, b] if measure == Q2 else test[a, b] / trace
                norm += test[a, b] ** 2
        stretch = math.sqrt(math.sqrt(norm))  # no less than the root of the largest eigenvalue
        total = 0.0
        for i in range(clusters.shape[0]):
            largest = 0.0
            for node in range(tree[clusters[i], 2], tree[clusters[i], 3]):
                share[:] = 0.0
                _add_gram(frame, normals[node], arms[node], n_basis, share)
                value, reach = 0.0, 0.0
                for a in range(d):
                    for b in range(d):
                        value += test[a, b] * share[a, b]
                for k in range(3):
                    reach += arms[node, k] ** 2
                change = (1.0 if n_basis != 3 and (n_basis == 1 or d == 3) else 0.0) + (
                    reach if d == 3 else 0.0
                )
                largest = max(largest, math.sqrt(max(value, 0.0)) + stretch * turn * math.sqrt(change))
            total += largest * largest
        if measure == Q2:
            return float(min(bound, root * (total / d) ** (0.5 * d) * (1.0 + 1e-9)))
        bound = min(bound, math.sqrt(total) * (1.0 + 1e-9))
        if bound <= lower:
            break
        for a in range(d):
            for b in range(d):
                value = 0.0
                for k in range(d):
                    value += test[a, k] * test[k, b]
                square[a, b] = value
        test, square = square, test
    return float(bound)
