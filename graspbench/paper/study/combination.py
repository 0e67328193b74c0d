"""A small regularised combination of predictors: ridge for ranks, logistic for success.

Both are convex and solved to the end; the strength of the regularisation is chosen on the training objects
alone, by leaving some of them out in turn.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import rankdata

from graspbench.arrays import BoolArray, FloatArray
from graspbench.paper.study.statistics import (
    areas_under_curve,
    folds_of,
    held_out,
    once,
    rank_correlations,
)

STRENGTHS = (0.3, 3.0, 30.0, 300.0)
INNER_FOLDS = 4

Predict = Callable[[BoolArray], FloatArray]


class Features:
    """Predictors as columns of ranks, with what is not known at the middle.

    Ranks among the training rows make the columns alike whatever the unit and the tail.

    Args:
        columns: Predictors by name, each of shape (n,).
    """

    def __init__(self, columns: Mapping[str, FloatArray]) -> None:
        self.names = tuple(columns)
        self._values = np.column_stack(list(columns.values()))

    def scaled(self, train: BoolArray, rows: BoolArray) -> FloatArray:
        """Return rows as quantiles among the training rows, -1 to 1, shape (m, k)."""
        known, wanted = self._values[train], self._values[rows]
        scaled = np.zeros(wanted.shape)
        for k in range(known.shape[1]):
            ordered = np.sort(known[np.isfinite(known[:, k]), k])
            if not len(ordered):
                continue
            middle = 0.5 * (
                np.searchsorted(ordered, wanted[:, k], "left")
                + np.searchsorted(ordered, wanted[:, k], "right")
            )
            scaled[:, k] = np.where(np.isfinite(wanted[:, k]), 2.0 * middle / len(ordered) - 1.0, 0.0)
        return scaled


def ridge(features: Features, outcome: FloatArray, strength: float, train: BoolArray) -> Predict:
    """Return what predicts ranks of the outcome, by ridge regression on the training rows."""
    x = features.scaled(train, train)
    y = rankdata(outcome[train]) / np.count_nonzero(train)
    middle = x.mean(axis=0)
    centred = x - middle
    weights = np.linalg.solve(centred.T @ centred + strength * np.eye(x.shape[1]), centred.T @ (y - y.mean()))
    return lambda rows: np.asarray((features.scaled(train, rows) - middle) @ weights + y.mean())


def logistic(features: Features, outcome: FloatArray, strength: float, train: BoolArray) -> Predict:
    """Return what predicts the log-odds of success, by penalised logistic regression on the training rows."""
    x, sign = features.scaled(train, train), np.where(outcome[train] > 0.5, 1.0, -1.0)

    def cost(w: FloatArray) -> tuple[float, FloatArray]:
        margin = sign * (x @ w[:-1] + w[-1])
        pull = -sign / (1.0 + np.exp(np.clip(margin, -60.0, 60.0)))
        penalty = np.append(strength * w[:-1], 0.0)
        value = float(np.logaddexp(0.0, -margin).sum() + 0.5 * strength * w[:-1] @ w[:-1])
        return value, np.append(x.T @ pull, pull.sum()) + penalty

    found = minimize(cost, np.zeros(x.shape[1] + 1), jac=True, method="L-BFGS-B").x
    return lambda rows: np.asarray(features.scaled(train, rows) @ found[:-1] + found[-1])


def fitted(
    kind: Callable[[Features, FloatArray, float, BoolArray], Predict],
    features: Features,
    outcome: FloatArray,
    objects: NDArray[np.str_],
    train: BoolArray,
) -> Predict:
    """Return a combination fitted to training rows, its strength chosen by leaving objects out of these."""
    score = areas_under_curve if kind is logistic else rank_correlations
    rows = np.flatnonzero(train)
    folds = folds_of(objects[rows], INNER_FOLDS, seed=1)

    def quality(strength: float) -> float:
        def fit(inside: BoolArray) -> Predict:
            predict = kind(features, outcome, strength, _among(rows[inside], len(train)))
            return lambda chosen: predict(_among(rows[chosen], len(train)))

        value = once(score, held_out(fit, folds), outcome[rows])
        return value if np.isfinite(value) else -np.inf

    return kind(features, outcome, max(STRENGTHS, key=quality), train)


def _among(rows: NDArray[np.int64], count: int) -> BoolArray:
    mask: BoolArray = np.zeros(count, dtype=np.bool_)
    mask[rows] = True
    return mask
