"""Radius of the largest origin-centred ball in a grasp wrench space, exactly.

The radius is the smallest value of the wrench space's support function over all unit directions, and it is
attained at the normal of a facet. This module does it for the hull of the union of the contacts' wrench
polytopes; their Minkowski sum has a module of its own. A direction d and an offset c that satisfy
w . d + c <= 0 for all corners w form a polyhedral cone, whose extreme rays are the facets.

Each facet is spanned by faces of the contacts' polytopes, one face a contact, that are affinely independent
of each other. It is therefore enough to fix all but two of a facet's corners, a *base*, in all the ways that
the contacts' faces allow: what is left is a cone in three dimensions, a polygon on the sphere, which the
other corners cut out. Most bases are no faces of the hull at all, and their polygon is empty after a few
cuts. On the others -c / |d| is least at a corner: so only what cuts off the least one has to be looked at,
until nothing does, or the least one is farther than what is known already.

In regular grasps the hull is degenerate: facets have more corners than they need, and the polygon of a base
inside one is a single point, or an arc, which rounding would cut away. So the search is for the facets of
corners that are displaced a little, each contact's polytope as a whole and all in different ways: that leaves
no polygon thin, and changes the smallest support by less than the displacement. The value returned is the
support of the true corners in a direction met on the way, which is never below the minimum.
"""

from functools import lru_cache
from itertools import product
from math import prod
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.grasp.contact import ContactPolytope
from graspbench.grasp.epsilon_of_sum import smallest_support_of_sum
from graspbench.grasp.free_directions import remove_directions
from graspbench.grasp.polygon import least_on_polygon

FaceTable = tuple[IntArray, IntArray]
"""Corners of every face, padded with -1, and the offsets of faces with 0, 1, 2... independent corners."""

CLOSURE_TOLERANCE = 1e-9
"""Ball radius below which a grasp counts as not force closure (rounding; wrenches are of order one)."""

_DISPLACEMENT = 1e-10  # the largest one of a corner, over the length of the longest wrench
_INDEPENDENT = 1e-18  # squared: what is less off the span of others is off it by displacement alone
_ON_FACET = 1e-8  # a corner this little below a displaced facet is on the true one


@lru_cache(maxsize=64)
def face_table(polytope: ContactPolytope) -> FaceTable:
    """Lay out a contact polytope's faces by the number of corners that span them."""
    by_rank: list[list[list[int]]] = [[[]], *(faces.tolist() for faces in polytope.faces)]
    flat = [face for faces in by_rank for face in faces]
    width = max(len(face) for face in flat)
    corners = np.array([face + [-1] * (width - len(face)) for face in flat], dtype=np.int64)
    start = np.concatenate(([0], np.cumsum([len(faces) for faces in by_rank]))).astype(np.int64)
    return corners, start


@lru_cache(maxsize=256)
def base_shares(polytope: ContactPolytope, contacts: int, size: int) -> IntArray:
    """Return how many corners of each contact a base has, for a set of bases that every facet has one of.

    Args:
        polytope: Contact polytope.
        contacts: Number of contacts.
        size: Components of a wrench.

    Returns:
        Shape (n, contacts); empty where there are too few contacts to span the space.
    """
    counts = np.diff(face_table(polytope)[1])
    ranks = list(product(range(len(counts)), repeat=contacts))
    facets = {share for share in ranks if sum(share) == size}
    covers = {
        base: {facet for facet in facets if all(b <= f for b, f in zip(base, facet, strict=True))}
        for base in ranks
        if sum(base) == size - 2
    }
    costs = {base: prod(int(counts[rank]) for rank in base) for base in covers}
    chosen = []
    while facets:  # the cheapest cover, greedily
        base = min(covers, key=lambda b: (costs[b] / max(len(covers[b] & facets), 1e-9), b))
        chosen.append(base)
        facets = facets - covers[base]
    return np.array(chosen, dtype=np.int64).reshape(-1, contacts)


def smallest_support(
    wrenches: FloatArray, polytope: ContactPolytope, *, minkowski: bool = False, stop_at: float = -np.inf
) -> FloatArray:
    """Return the smallest support of grasp wrench spaces over all unit directions.

    Args:
        wrenches: Wrenches of the polytope's corners at each contact, shape (n, n_f, n_vertices, d).
        polytope: Contact polytope that the wrenches come from.
        minkowski: Minkowski sum of the contacts' polytopes (L-infinity) instead of the hull of their
            union (L1).
        stop_at: Give up as soon as a value is known to be at most this; the value returned is then
            an upper bound.

    Returns:
        Shape (n,); not positive where the origin is not inside, 0 where the wrenches do not span the space.
    """
    if minkowski:
        return smallest_support_of_sum(wrenches, polytope, stop_at)
    _, n_f, _, size = wrenches.shape
    corners, start = face_table(polytope)
    shares = base_shares(polytope, n_f, size)
    shifts = _displacements(polytope, n_f, size)
    batch = np.ascontiguousarray(wrenches)
    return np.asarray(_smallest_support_batch(batch, shifts, corners, start, shares, stop_at))


@lru_cache(maxsize=256)
def _displacements(polytope: ContactPolytope, contacts: int, size: int) -> FloatArray:
    """Return a displacement of every corner: for each contact a linear map of its polytope, always the same.

    Returns:
        Shape (contacts, n_vertices, size), each at most `_DISPLACEMENT` long.
    """
    unit = polytope.vertices / np.abs(polytope.vertices).max(axis=0)
    maps = np.random.default_rng(0).uniform(-1.0, 1.0, (contacts, unit.shape[1], size))
    return np.asarray(_DISPLACEMENT / (unit.shape[1] * np.sqrt(size)) * (unit @ maps))


@compiled
def _smallest_support_batch(
    wrenches: FloatArray,
    shifts: FloatArray,
    corners: IntArray,
    start: IntArray,
    shares: IntArray,
    stop_at: float,
) -> FloatArray:
    values = np.empty(wrenches.shape[0])
    for g in range(wrenches.shape[0]):
        values[g] = smallest_support_one(wrenches[g], shifts, corners, start, shares, stop_at)
    return values


@inner
def smallest_support_one(
    wrenches: FloatArray,
    shifts: FloatArray,
    corners: IntArray,
    start: IntArray,
    shares: IntArray,
    stop_at: float,
) -> float:
    """Return one grasp's smallest support; arguments as laid out by `smallest_support`."""
    n_f, n_v, d = wrenches.shape
    size = d + 1
    columns = np.ones((size, n_f * n_v))  # of each corner its wrench, and a one for the offset
    moved = np.ones((size, n_f * n_v))
    scale = _corner_columns(wrenches, shifts, columns, moved)
    free = np.zeros((max(n_f, d) + 1, size, size))  # orthonormal rows: what the chosen corners leave free
    for k in range(size):
        free[0, k, k] = 1.0
    dims = np.empty(len(free), np.int64)
    dims[0] = size
    face = np.empty(n_f, np.int64)
    part, rows = np.empty(size), np.empty((size, size))
    cuts = np.empty((3, n_f * n_v))
    polygons = np.empty((2, 2 * n_f * n_v + 8, 3))
    ray = np.zeros(size)
    best = np.inf  # of the displaced corners
    found = np.inf  # of the true ones
    for s in range(shares.shape[0]):
        level: Any = np.int64(0)  # typed at once, or all below is compiled for a literal first
        face[0] = start[shares[s, 0]] - 1
        while level >= 0:
            face[level] += 1
            if face[level] >= start[shares[s, level] + 1]:
                level -= 1
                continue
            share = shares[s, level]
            for r in range(share):
                for b in range(size):
                    rows[r, b] = moved[b, level * n_v + corners[face[level], r]]
            if not remove_directions(free, dims, level, rows, share, part, _INDEPENDENT):
                continue
            if level + 1 < n_f:
                level += 1
                face[level] = start[shares[s, level]] - 1
                continue
            least = least_on_polygon(moved, free[n_f], cuts, polygons, best, ray)
            if least >= best:
                continue
            best = least
            found = min(found, _support(columns, ray))
            if found * scale <= stop_at:
                return float(found * scale)
    if found == np.inf:
        return 0.0
    _settle(free, dims, columns, part, ray)
    return float(min(found, _support(columns, ray)) * scale)


@inner
def _corner_columns(
    wrenches: FloatArray, shifts: FloatArray, columns: FloatArray, moved: FloatArray
) -> float:
    """Write each corner's wrench over the length of the longest, true and displaced; return the length."""
    n_f, n_v, d = wrenches.shape
    longest = 1e-300
    for i in range(n_f):
        for v in range(n_v):
            square = 0.0
            for k in range(d):
                square += wrenches[i, v, k] ** 2
                columns[k, i * n_v + v] = wrenches[i, v, k]
            longest = max(longest, square)
    longest = np.sqrt(longest)
    for k in range(d):
        for j in range(columns.shape[1]):
            columns[k, j] /= longest
            moved[k, j] = columns[k, j] + shifts[j // n_v, j % n_v, k]
    return float(longest)


@inner
def _support(columns: FloatArray, ray: FloatArray) -> float:
    """Return the support in the direction of a ray."""
    d = len(ray) - 1
    square, highest = 0.0, -np.inf
    for k in range(d):
        square += ray[k] ** 2
    for j in range(columns.shape[1]):
        height = 0.0
        for k in range(d):
            height += ray[k] * columns[k, j]
        highest = max(highest, height)
    return float(highest / np.sqrt(max(square, 1e-300)))


@inner
def _settle(free: FloatArray, dims: IntArray, columns: FloatArray, part: FloatArray, ray: FloatArray) -> None:
    """Move the ray of a displaced facet to the true one, which has the same corners."""
    level: Any = np.int64(0)
    row = np.empty((1, len(ray)))
    length = 0.0
    for b in range(len(ray) - 1):
        length += ray[b] ** 2
    length = np.sqrt(length)
    for j in range(columns.shape[1]):
        height = 0.0
        for b in range(len(ray)):
            row[0, b] = columns[b, j]
            height += ray[b] * columns[b, j]
        on_facet = height >= -_ON_FACET * length and level < len(ray) - 1
        if on_facet and remove_directions(free, dims, level, row, 1, part, _INDEPENDENT):
            level += 1
    for a in range(dims[level]):
        part[a] = 0.0
        for b in range(len(ray)):
            part[a] += free[level, a, b] * ray[b]
    for b in range(len(ray)):
        ray[b] = 0.0
        for a in range(dims[level]):
            ray[b] += part[a] * free[level, a, b]
