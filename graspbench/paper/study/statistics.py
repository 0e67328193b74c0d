"""How well numbers foretell outcomes: rank correlation and AUC, bootstrapped over objects."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from graspbench.arrays import BoolArray, FloatArray
from graspbench.report.statistics import Interval

RESAMPLES = 1000
CONFIDENCE = 0.95

Score = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""Of predictions and outcomes, shape (n,), and how often each row counts in each sample, shape (r, n)."""


def rank_correlations(predicted: FloatArray, outcome: FloatArray, counts: FloatArray) -> FloatArray:
    """Return Spearman's rank correlation in each sample, shape (r,); nan where one side is constant.

    Args:
        predicted: Shape (n,); rows that are not finite are left out.
        outcome: Shape (n,).
        counts: How often each row is in each sample, shape (r, n).
    """
    use = np.isfinite(predicted) & np.isfinite(outcome)
    weights = counts[:, use]
    a, b = _mid_ranks(predicted[use], weights), _mid_ranks(outcome[use], weights)
    sizes = np.maximum(weights.sum(axis=1, keepdims=True), 1.0)
    a -= (weights * a).sum(axis=1, keepdims=True) / sizes
    b -= (weights * b).sum(axis=1, keepdims=True) / sizes
    spread = np.sqrt((weights * a * a).sum(axis=1) * (weights * b * b).sum(axis=1))
    known = spread > 1e-9
    together = (weights * a * b).sum(axis=1)
    return np.where(known, together / np.where(known, spread, 1.0), np.nan)


def areas_under_curve(predicted: FloatArray, outcome: FloatArray, counts: FloatArray) -> FloatArray:
    """Return the chance that a grasp that withstands is given a larger number than one that does not.

    Equal numbers count half (Hanley and McNeil 1982). Nan where a sample has only one kind.

    Args:
        predicted: Shape (n,); rows that are not finite are left out.
        outcome: 1 where the grasp withstands, 0 where not, shape (n,).
        counts: How often each row is in each sample, shape (r, n).
    """
    use = np.isfinite(predicted)
    weights, good = counts[:, use], outcome[use] > 0.5
    ranks = _mid_ranks(predicted[use], weights)
    n_good, n_bad = weights[:, good].sum(axis=1), weights[:, ~good].sum(axis=1)
    above = (weights[:, good] * ranks[:, good]).sum(axis=1) - n_good * (n_good + 1.0) / 2.0
    pairs = n_good * n_bad
    return np.where(pairs > 0.0, above / np.where(pairs > 0.0, pairs, 1.0), np.nan)


def _mid_ranks(values: FloatArray, counts: FloatArray) -> FloatArray:
    """Return each row's rank in each sample, equals sharing theirs, shape (r, n)."""
    if not len(values):
        return np.zeros(counts.shape)
    _, which = np.unique(values, return_inverse=True)
    order = np.argsort(which, kind="stable")
    starts = np.flatnonzero(np.diff(which[order], prepend=-1))
    sizes = np.add.reduceat(counts[:, order], starts, axis=1)
    ranks: FloatArray = (np.cumsum(sizes, axis=1) - sizes + (sizes + 1.0) / 2.0)[:, which]
    return ranks


def once(score: Score, predicted: FloatArray, outcome: FloatArray) -> float:
    """Return a score of the rows as they are."""
    return float(score(predicted, outcome, np.ones((1, len(predicted))))[0])


def bootstrapped(
    score: Score, predicted: FloatArray, outcome: FloatArray, objects: NDArray[np.str_], seed: int = 0
) -> Interval:
    """Return a score with its percentile interval over resampled objects, all grasps of each kept together.

    Args:
        score: `rank_correlations` or `areas_under_curve`.
        predicted: Shape (n,).
        outcome: Shape (n,).
        objects: Object of each grasp, shape (n,).
        seed: Of the resampling.
    """
    names, which = np.unique(objects, return_inverse=True)
    drawn = np.random.default_rng(seed).multinomial(
        len(names), np.full(len(names), 1.0 / len(names)), size=RESAMPLES
    )
    values = score(predicted, outcome, drawn[:, which].astype(np.float64))
    known, value = values[np.isfinite(values)], once(score, predicted, outcome)
    if len(known) == 0:
        return Interval(value, float("nan"), float("nan"), len(predicted))
    low, high = np.quantile(known, [(1.0 - CONFIDENCE) / 2, (1.0 + CONFIDENCE) / 2])
    return Interval(value, float(low), float(high), len(predicted))


def folds_of(objects: NDArray[np.str_], count: int, seed: int = 0) -> NDArray[np.int64]:
    """Return the fold of each grasp; an object is in one fold with all its grasps, shape (n,)."""
    names, which = np.unique(objects, return_inverse=True)
    order = np.random.default_rng(seed).permutation(len(names))
    fold: NDArray[np.int64] = (order % count)[which]
    return fold


def held_out(
    fit: Callable[[BoolArray], Callable[[BoolArray], FloatArray]], folds: NDArray[np.int64]
) -> FloatArray:
    """Return predictions for each grasp by what was fitted to the objects of the other folds, shape (n,).

    Args:
        fit: Takes which rows it may look at, and returns what predicts for rows.
        folds: Of each grasp, shape (n,).
    """
    predicted = np.full(len(folds), np.nan)
    for fold in np.unique(folds):
        test = folds == fold
        predicted[test] = fit(~test)(test)
    return predicted
