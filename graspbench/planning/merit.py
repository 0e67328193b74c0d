"""Which of many local optima is the best grasp, without the exact ball radius of each."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from heapq import heapify, heappop, heappush

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.grasp.quality import GraspQuality, QualityParameters, grasp_quality, singular_measures
from graspbench.grasp.wrench import grasp_matrix, wrench_maps
from graspbench.reconstruction.surface import Surface

_DIRECTIONS = 512
_WALKS = 6
_STEPS = 40


def merit_of(quality: GraspQuality) -> float:
    """Return the geometric mean of Q1, Q2 and Q3, which does not depend on their units."""
    return float(np.cbrt(quality.q1 * quality.q2 * quality.q3))


def quality_of(
    surface: Surface, vertices: IntArray, quality: QualityParameters, torque_length_m: float
) -> GraspQuality:
    """Return Q1, Q2 and Q3 of a grasp on a surface, vertices of shape (n_f,), or of many, (m, n_f)."""
    return grasp_quality(
        surface.points[vertices],
        -surface.normals[vertices],
        surface.centroid,
        contact=quality.contact,
        wrench_space=quality.wrench_space,
        friction=quality.friction,
        cone_edges=quality.cone_edges,
        torque_length=torque_length_m,
        torsional_friction=quality.torsion(torque_length_m),
        norm=quality.norm,
    )


def best_first(
    surface: Surface, grasps: Sequence[IntArray], quality: QualityParameters, torque_length_m: float
) -> Iterator[tuple[int, float]]:
    """Yield grasps in descending order of merit, each with its exact merit.

    A grasp's exact Q3 is computed only when a bound of it, from a fixed set of directions, says that it
    may come next.

    Args:
        surface: The surface at rest.
        grasps: Vertices of each grasp, shape (n_f,) each.
        quality: How quality is measured.
        torque_length_m: Torques are divided by it.

    Yields:
        Index into ``grasps``, and the merit (0 when the grasp is not force closure).
    """
    if not grasps:
        return
    bounds = _merit_bounds(surface, np.stack(list(grasps)), quality, torque_length_m)
    queue = [(-float(bound), k, False) for k, bound in enumerate(bounds)]
    heapify(queue)
    while queue:
        value, k, exact = heappop(queue)
        if exact or value == 0.0:
            yield k, -value
        else:
            merit = merit_of(quality_of(surface, grasps[k], quality, torque_length_m))
            heappush(queue, (-merit, k, True))


def _merit_bounds(
    surface: Surface, vertices: IntArray, quality: QualityParameters, torque_length_m: float
) -> FloatArray:
    """Return upper bounds of the merits, shape (n,): Q1 and Q2 are exact, Q3 a bound."""
    maps = wrench_maps(
        surface.points[vertices],
        -surface.normals[vertices],
        surface.centroid,
        contact=quality.contact,
        wrench_space=quality.wrench_space,
        torque_length=torque_length_m,
    )
    q1, q2 = singular_measures(grasp_matrix(maps))
    bounds: FloatArray = np.cbrt(q1 * q2 * support_bounds(maps, quality, torque_length_m))
    return bounds


def support_bounds(
    maps: FloatArray,
    quality: QualityParameters,
    torque_length_m: float,
    *,
    tight: bool = True,
    directions: int | None = None,
) -> FloatArray:
    """Return upper bounds of Q3, shape (n,), from wrench maps of shape (n, n_f, d, n_basis).

    The ball's radius is the least support over all directions, so the least over any set bounds it: a fixed
    set (only the first ``directions`` of it, if given), and for ``tight`` bounds also what a descent from the
    best of them meets.
    """
    wrenches = quality.polytope(torque_length_m).vertices @ np.swapaxes(maps, -1, -2)
    size = maps.shape[-2]
    supports = _supports(wrenches, _directions(size)[:directions].T[None], quality.norm)
    bounds = supports.min(axis=-1)
    if tight and quality.norm == "l1":
        starts = np.argsort(supports, axis=-1)[:, :_WALKS]
        bounds = np.minimum(bounds, _walked(wrenches.reshape(len(maps), -1, size), _directions(size)[starts]))
    tightest: FloatArray = np.maximum(bounds, 0.0)
    return tightest


def _supports(wrenches: FloatArray, directions: FloatArray, norm: str) -> FloatArray:
    """Return the grasp wrench space's support in each direction (columns), shape (n, n_directions)."""
    of_contact = (wrenches @ directions[:, None]).max(axis=-2)
    total: FloatArray = of_contact.max(axis=1) if norm == "l1" else np.maximum(of_contact, 0.0).sum(axis=1)
    return total


def _walked(wrenches: FloatArray, directions: FloatArray) -> FloatArray:
    """Walk directions towards smaller support by its subgradient, the farthest wrench.

    Args:
        wrenches: Corners of the wrench space's hull, shape (n, n_corners, d).
        directions: Where to begin, shape (n, n_walks, d).

    Returns:
        The least support met on the way, shape (n,).
    """
    least = np.full(len(wrenches), np.inf)
    step = 0.2
    for _ in range(_STEPS):
        heights = directions @ np.swapaxes(wrenches, -1, -2)
        farthest = heights.argmax(axis=-1)
        least = np.minimum(least, heights.max(axis=-1).min(axis=-1))
        down = np.take_along_axis(wrenches, farthest[..., None], axis=1)
        directions = directions - step * down
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        step *= 0.9
    return least


@lru_cache(maxsize=8)
def _directions(size: int) -> FloatArray:
    """Return fixed unit directions of a wrench space, the axes among them, shape (n, size)."""
    drawn = np.random.default_rng(0).standard_normal((_DIRECTIONS, size))
    axes = np.concatenate((np.eye(size), -np.eye(size)))
    return np.concatenate((axes, drawn / np.linalg.norm(drawn, axis=1, keepdims=True)))
