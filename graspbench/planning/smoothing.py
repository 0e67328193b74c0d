"""Smooth ways through a plan's configurations: the spatial filter of the fingertips' paths (thesis 3.5)."""

import numpy as np
from scipy.linalg import solveh_banded

from graspbench.arrays import FloatArray

_SPACING_M = 2e-3
_MIN_SAMPLES, _MAX_SAMPLES = 8, 160
_STIFFNESS = 10.0 ** np.arange(0.0, 9.0, 0.5)
_REVERSAL_DEG = 60.0


def low_pass(values: FloatArray, gain: float) -> FloatArray:
    """Filter a sequence of configurations: each moves by ``gain`` of the way to the new value.

    It knows only what came before, with one step delay, so it can run while the planner works.

    Args:
        values: Shape (n, ...), first to last.
        gain: 0 to 1; 1 passes everything.
    """
    filtered = np.empty_like(values)
    filtered[0] = values[0]
    for k in range(1, len(values)):
        filtered[k] = filtered[k - 1] + gain * (values[k] - filtered[k - 1])
    return filtered


def smooth_way(
    points: FloatArray, normals: FloatArray, max_turning_deg: float, max_deviation_m: float
) -> tuple[FloatArray, FloatArray]:
    """Draw a smooth way for all fingers through a finished sequence of configurations.

    The way from first to last is sampled evenly, all fingers alike, and bent as little as it takes: the
    squared distance from the samples plus a stiffness times the squared second differences is smallest, with
    both ends fixed. The stiffness rises until every finger turns at most as far as asked for, and nowhere
    back. Loops and back-steps of the planner vanish so.

    Args:
        points: Where the tips should pass, shape (n, n_f, 3), m.
        normals: Surface normals there, shape (n, n_f, 3).
        max_turning_deg: How far each finger may turn in all.
        max_deviation_m: How far the way may be from the configurations; then it is not smoothed further.

    Returns:
        Points and unit normals of the way, shape (m, n_f, 3) each.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1)
    where = np.concatenate(([0.0], np.cumsum(steps)))
    if len(points) < 3 or where[-1] < 1e-4:
        return points, _unit(normals)
    count = int(np.clip(np.ceil(where[-1] / _SPACING_M), _MIN_SAMPLES, _MAX_SAMPLES))
    wanted = np.stack([_sampled(values, where, count) for values in (points, normals)], axis=1)
    way = wanted
    for stiffness in _STIFFNESS:
        if _is_smooth(way[:, 0], max_turning_deg):
            break
        smoother = _stiffened(wanted, stiffness)
        if _strays(smoother[:, 0], wanted[:, 0], max_deviation_m):
            break
        way = smoother
    return way[:, 0], _unit(way[:, 1])


def turning_deg(path: FloatArray) -> tuple[float, float]:
    """Return how far a path turns in all, and at most from one segment of 2 mm to the next, deg.

    Args:
        path: Shape (n, 3), m.
    """
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    where = np.concatenate(([0.0], np.cumsum(steps)))
    if where[-1] < 2.0 * _SPACING_M:
        return 0.0, 0.0
    even = _sampled(path, where, int(where[-1] / _SPACING_M) + 1)
    segments = np.diff(even, axis=0)
    lengths = np.linalg.norm(segments, axis=1)
    segments = segments[lengths > 0.0] / lengths[lengths > 0.0, None]
    turns = np.rad2deg(np.arccos(np.clip((segments[1:] * segments[:-1]).sum(axis=1), -1.0, 1.0)))
    return (float(turns.sum()), float(turns.max())) if len(turns) else (0.0, 0.0)


def _is_smooth(points: FloatArray, max_turning_deg: float) -> bool:
    turns = np.array([turning_deg(points[:, i]) for i in range(points.shape[1])])
    return bool(turns[:, 0].max() <= max_turning_deg and turns[:, 1].max() <= _REVERSAL_DEG)


def _sampled(values: FloatArray, where: FloatArray, count: int) -> FloatArray:
    """Interpolate values, shape (n, ...), given at ``where``, at so many even places."""
    at = np.linspace(0.0, where[-1], count)
    after = np.clip(np.searchsorted(where, at, side="right"), 1, len(where) - 1)
    length = where[after] - where[after - 1]
    share = np.where(length > 0.0, (at - where[after - 1]) / np.maximum(length, 1e-300), 1.0)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    sampled: FloatArray = (1.0 - share) * values[after - 1] + share * values[after]
    return sampled


def _stiffened(values: FloatArray, stiffness: float) -> FloatArray:
    """Return the least bent values near given ones, shape (n, ...), the first and last as they are."""
    n = len(values)
    # The squared second differences' matrix has five diagonals: the main one, its neighbours, and ones.
    main, beside = np.zeros(n), np.full(n - 1, -4.0)
    main[:-2] += 1.0
    main[1:-1] += 4.0
    main[2:] += 1.0
    beside[[0, -1]] += 2.0
    flat = values.reshape(n, -1)
    right = flat[1:-1].copy()
    right[0] -= stiffness * beside[0] * flat[0]
    right[-1] -= stiffness * beside[-1] * flat[-1]
    right[1:2] -= stiffness * flat[0]
    right[-2:-1] -= stiffness * flat[-1]
    bands = np.zeros((3, n - 2))
    bands[0] = 1.0 + stiffness * main[1:-1]
    bands[1, :-1] = stiffness * beside[1:-1]
    bands[2, :-2] = stiffness
    out = flat.copy()
    out[1:-1] = solveh_banded(bands, right, lower=True)
    return out.reshape(values.shape)


def _strays(way: FloatArray, wanted: FloatArray, max_deviation_m: float) -> bool:
    """Tell whether any sample of a way, shape (n, n_f, 3), is too far from all that are wanted, same shape.

    Most are near their own one, so that the others need no look.
    """
    far = _distances(way, wanted) > max_deviation_m
    for finger in np.flatnonzero(far.any(axis=0)):
        samples = way[far[:, finger], None, finger]
        if np.any(_distances(samples, wanted[None, :, finger]).min(axis=1) > max_deviation_m):
            return True
    return False


def _distances(points: FloatArray, others: FloatArray) -> FloatArray:
    apart = points - others
    # An axis at a time: three times as fast as norms of rows.
    squared = apart[..., 0] ** 2 + apart[..., 1] ** 2 + apart[..., 2] ** 2
    return np.asarray(np.sqrt(squared))


def _unit(normals: FloatArray) -> FloatArray:
    scaled: FloatArray = normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    return scaled
