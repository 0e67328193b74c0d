"""Radius of the largest origin-centred ball in the Minkowski sum of the contacts' wrench polytopes, exactly.

The radius is the smallest value of the sum's support function over all unit directions, and it is attained at
the normal of a facet. Each facet is spanned by the edges of one face a contact, that are independent of each
other: if a contact's share of the facet is larger than what is needed to span it, a smaller face of that
share does. So it is enough to try the normals of all such combinations. A combination that is no facet does
no harm, since the support function is never below its minimum; no tolerance decides what is a facet.
"""

from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.grasp.contact import ContactPolytope
from graspbench.grasp.free_directions import remove_directions

_INDEPENDENT = 1e-26  # squared share of a row off the span of others below which it is rounding

FaceTable = tuple[IntArray, IntArray]
"""Corners of every face, padded with -1, and the offsets of faces of dimension 0, 1, 2..."""


@lru_cache(maxsize=64)
def pyramid_table(polytope: ContactPolytope) -> FaceTable:
    """Lay out the faces of the pyramid over a contact polytope, by their dimension.

    The apex, the last corner, is in the origin: a finger may also push less.
    """
    apex = len(polytope.vertices)
    by_dimension = [[[corner] for corner in range(apex + 1)]]
    for k, faces in enumerate(polytope.faces):
        pyramids = [[apex, *face] for face in faces.tolist()]
        higher = polytope.faces[k + 1].tolist() if k + 1 < len(polytope.faces) else []
        by_dimension.append(pyramids + higher)
    flat = [face for faces in by_dimension for face in faces]
    width = max(len(face) for face in flat)
    corners = np.array([face + [-1] * (width - len(face)) for face in flat], dtype=np.int64)
    start = np.concatenate(([0], np.cumsum([len(faces) for faces in by_dimension]))).astype(np.int64)
    return corners, start


@lru_cache(maxsize=64)
def row_shares(contacts: int, rows: int, largest: int) -> IntArray:
    """Return all ways to share ``rows`` among the contacts, at most ``largest`` each; shape (n, contacts)."""
    shares = [s for s in product(range(min(rows, largest) + 1), repeat=contacts) if sum(s) == rows]
    return np.array(shares, dtype=np.int64).reshape(-1, contacts)


def smallest_support_of_sum(
    wrenches: FloatArray, polytope: ContactPolytope, stop_at: float = -np.inf
) -> FloatArray:
    """Return the smallest support of Minkowski sums; see `graspbench.grasp.epsilon.smallest_support`."""
    _, n_f, _, size = wrenches.shape
    corners, start = pyramid_table(polytope)
    shares = row_shares(n_f, size - 1, len(start) - 2)
    return np.asarray(_batch(np.ascontiguousarray(wrenches), corners, start, shares, stop_at))


@compiled
def _batch(
    wrenches: FloatArray, corners: IntArray, start: IntArray, shares: IntArray, stop_at: float
) -> FloatArray:
    values = np.empty(wrenches.shape[0])
    for g in range(wrenches.shape[0]):
        values[g] = _smallest_support(wrenches[g], corners, start, shares, stop_at)
    return values


@inner
def _smallest_support(
    wrenches: FloatArray, corners: IntArray, start: IntArray, shares: IntArray, stop_at: float
) -> float:
    n_f, n_v, size = wrenches.shape
    points = np.zeros((n_f, n_v + 1, size))
    points[:, :n_v] = wrenches
    free = np.zeros((n_f + 1, size, size))  # orthonormal rows: what the chosen rows leave free
    for k in range(size):
        free[0, k, k] = 1.0
    dims = np.empty(n_f + 1, np.int64)
    dims[0] = size
    face = np.empty(n_f, np.int64)
    normal, part, rows = np.empty(size), np.empty(size), np.empty((size, size))
    best = np.inf
    for s in range(shares.shape[0]):
        level: Any = np.int64(0)  # typed at once, or all below is compiled for a literal first
        face[0] = start[shares[s, 0]] - 1
        while level >= 0:
            face[level] += 1
            share = shares[s, level]
            if face[level] >= start[share + 1] or (share == 0 and face[level] > start[0]):
                level -= 1
                continue
            for r in range(share):
                for b in range(size):
                    tip, foot = corners[face[level], r + 1], corners[face[level], 0]
                    rows[r, b] = points[level, tip, b] - points[level, foot, b]
            if not remove_directions(free, dims, level, rows, share, part, _INDEPENDENT):
                continue
            if level + 1 < n_f:
                level += 1
                face[level] = start[shares[s, level]] - 1
                continue
            length = 0.0
            for k in range(size):
                length += free[n_f, 0, k] ** 2
            if length < 1e-20:
                continue
            length = np.sqrt(length)
            for k in range(size):
                normal[k] = free[n_f, 0, k] / length
            best = min(best, _support_of_sum(points, normal, best))
            if best <= stop_at:
                return float(best)
    return float(best) if best < np.inf else 0.0


@inner
def _support_of_sum(points: FloatArray, normal: FloatArray, bound: float) -> float:
    """Return the smaller support of the two sides; anything above ``bound`` if both are."""
    high = 0.0
    low = 0.0
    for i in range(points.shape[0]):
        top = 0.0
        bottom = 0.0
        for j in range(points.shape[1]):
            value = 0.0
            for k in range(normal.shape[0]):
                value += points[i, j, k] * normal[k]
            top = max(top, value)
            bottom = min(bottom, value)
        high += top
        low += bottom
        if high > bound and -low > bound:
            return np.inf
    return min(high, -low)
