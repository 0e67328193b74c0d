"""Plain enumeration: every combination of nodes looked at, the peer of the certified search."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain, combinations
from math import comb

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.grasp.epsilon import CLOSURE_TOLERANCE, smallest_support
from graspbench.grasp.quality import QualityParameters
from graspbench.grasp.wrench import wrench_maps
from graspbench.planning.constraint import GraspConstraint
from graspbench.planning.indices.mirtich_canny import mirtich_canny_scores
from graspbench.reconstruction import Surface

_BLOCK = 4096

Values = Callable[[IntArray, float], FloatArray]


@dataclass(frozen=True)
class Limits:
    """What a grasp has to keep.

    Attributes:
        checker: The hand; None for none.
        centre_tolerance_m: Largest distance of the contacts' mean from the centroid; None for any.
        phi_cei_deg: Largest coplanarity error of ``mirtich_canny``.
        phi_eegi_deg: Largest equilateral error of ``mirtich_canny``.
    """

    checker: GraspConstraint | None
    centre_tolerance_m: float | None
    phi_cei_deg: float
    phi_eegi_deg: float


def all_combinations(nodes: int, n_f: int) -> IntArray:
    """Return every choice of ``n_f`` nodes, shape (m, n_f)."""
    flat = np.fromiter(chain.from_iterable(combinations(range(nodes), n_f)), dtype=np.int64)
    return flat.reshape(comb(nodes, n_f), n_f)


def enumerate_best(
    surface: Surface, grasps: IntArray, measure: str, quality: QualityParameters, limits: Limits
) -> float:
    """Return the largest measure among grasps that are force closure, within limits and held by the hand.

    Compiled arithmetic in batches (LAPACK, and this package's exact ball). What is cheap is asked first: the
    distances, the measure; closure and hand only of a grasp that would be the best so far.

    Args:
        surface: The surface.
        grasps: Every combination of its nodes, shape (m, n_f).
        measure: ``q1``, ``q2``, ``q3`` or ``mirtich_canny``.
        quality: Contact model; the wrench space is spatial, the norm L1.
        limits: The constraints.
    """
    wrenches, maps = _wrenches(surface, quality)
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    polytope, checker = quality.polytope(length_m), limits.checker
    values = _measure(surface, measure, maps, wrenches, quality, limits)
    best = -np.inf
    for start in range(0, len(grasps), _BLOCK):
        block = grasps[start : start + _BLOCK]
        block = block[_within(surface, block, limits)]
        found = values(block, max(best, CLOSURE_TOLERANCE))
        for k in np.argsort(-found, kind="stable"):
            if not found[k] > best:
                break
            nodes = block[k]
            if not smallest_support(wrenches[nodes][None], polytope, stop_at=CLOSURE_TOLERANCE)[0] > (
                CLOSURE_TOLERANCE
            ):
                continue
            if checker is None or checker.place(surface.points[nodes], surface.normals[nodes]) is not None:
                best = float(found[k])
    return best


def _wrenches(surface: Surface, quality: QualityParameters) -> tuple[FloatArray, FloatArray]:
    """Return each node's unit cone wrenches, shape (n, n_v, 6), and wrench maps, shape (n, 6, n_basis)."""
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    maps = wrench_maps(
        surface.points, -surface.normals, surface.centroid, contact=quality.contact, torque_length=length_m
    )
    return np.ascontiguousarray(quality.polytope(length_m).vertices @ np.swapaxes(maps, -1, -2)), maps


def _measure(
    surface: Surface,
    measure: str,
    maps: FloatArray,
    wrenches: FloatArray,
    quality: QualityParameters,
    limits: Limits,
) -> Values:
    """Return the function that measures a block of grasps; at or below the floor it need not be exact."""
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    grams, polytope = maps @ np.swapaxes(maps, -1, -2), quality.polytope(length_m)

    def singular(block: IntArray, floor: float) -> FloatArray:
        squared = sum(grams[block[:, i]] for i in range(block.shape[1]))
        if measure == "q1":
            return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(squared)[:, 0], 0.0)))
        return np.asarray(np.sqrt(np.maximum(np.linalg.det(squared), 0.0)))

    def ball(block: IntArray, floor: float) -> FloatArray:
        return smallest_support(wrenches[block], polytope, stop_at=floor)

    def outer_triangle(block: IntArray, floor: float) -> FloatArray:
        cei, eegi, area = mirtich_canny_scores(surface.points[block], -surface.normals[block])
        return np.where((cei <= limits.phi_cei_deg) & (eegi <= limits.phi_eegi_deg), area, -np.inf)

    return {"q3": ball, "mirtich_canny": outer_triangle}.get(measure, singular)


def _within(surface: Surface, block: IntArray, limits: Limits) -> BoolArray:
    """Tell which grasps can be touched, spanned, and are centred, shape (m,)."""
    points = surface.points
    keep = np.ones(len(block), dtype=np.bool_)
    if limits.centre_tolerance_m is not None:
        mean = sum(points[block[:, i]] for i in range(block.shape[1])) / block.shape[1]
        keep &= np.linalg.norm(mean - surface.centroid, axis=1) <= limits.centre_tolerance_m
    if limits.checker is not None:
        keep &= limits.checker.vertex_mask(points, surface.normals)[block].all(axis=1)
        for i, j in combinations(range(block.shape[1]), 2):
            gap = points[block[:, i]] - points[block[:, j]]
            keep &= np.einsum("ij,ij->i", gap, gap) <= limits.checker.pair_limit_m**2
    return keep
