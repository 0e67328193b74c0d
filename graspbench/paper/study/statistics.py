"""How well numbers foretell outcomes: rank correlation and AUC, bootstrapped over objects."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from graspbench.arrays import BoolArray, FloatArray
from graspbench.report.statistics import Interval

RESAMPLES = 1000
CONFIDENCE = 0.95

Score = Callable[[FloatArray, FloatArray], float]


def rank_correlation(predicted: FloatArray, outcome: FloatArray) -> float:
    """Return Spearman's rank correlation; nan where one side is constant or fewer than four are known."""
    use = np.isfinite(predicted) & np.isfinite(outcome)
    a, b = predicted[use], outcome[use]
    if len(a) < 4 or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return float("nan")
    return float(np.corrcoef(rankdata(a), rankdata(b))[0, 1])


def area_under_curve(predicted: FloatArray, outcome: FloatArray) -> float:
    """Return the chance that a grasp that withstands is given a larger number than one that does not.

    Equal numbers count half (Hanley and McNeil 1982). Nan where there is only one kind.

    Args:
        predicted: Shape (n,).
        outcome: 1 where the grasp withstands, 0 where not, shape (n,).
    """
    use = np.isfinite(predicted)
    good = outcome[use] > 0.5
    ranks = rankdata(predicted[use])
    n_good, n_bad = int(good.sum()), int((~good).sum())
    if n_good == 0 or n_bad == 0:
        return float("nan")
    return float((ranks[good].sum() - n_good * (n_good + 1) / 2) / (n_good * n_bad))


def bootstrapped(
    score: Score, predicted: FloatArray, outcome: FloatArray, objects: NDArray[np.str_], seed: int = 0
) -> Interval:
    """Return a score with its percentile interval over resampled objects, all grasps of each kept together.

    Args:
        score: Of predictions and outcomes.
        predicted: Shape (n,).
        outcome: Shape (n,).
        objects: Object of each grasp, shape (n,).
        seed: Of the resampling.
    """
    names, which = np.unique(objects, return_inverse=True)
    members = [np.flatnonzero(which == k) for k in range(len(names))]
    rng = np.random.default_rng(seed)
    values = []
    for _ in range(RESAMPLES):
        rows = np.concatenate([members[k] for k in rng.integers(len(names), size=len(names))])
        values.append(score(predicted[rows], outcome[rows]))
    known = np.array(values)[np.isfinite(values)]
    value = score(predicted, outcome)
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
