"""What foretells that a grasp withstands: every predictor alone, the best alone, and all combined."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from graspbench.arrays import BoolArray, FloatArray
from graspbench.paper.study.combination import Features, Predict, fitted, logistic, ridge
from graspbench.paper.study.outcomes import (
    predictor_columns,
    weakest_force,
    weakest_torque,
    withstands,
)
from graspbench.paper.study.statistics import (
    Score,
    areas_under_curve,
    bootstrapped,
    folds_of,
    held_out,
    once,
    rank_correlations,
)
from graspbench.report.statistics import Interval

FOLDS = 5
COMBINED, BEST = "combination", "best single"
FEWEST = 30
"""Grasps of a part of the table that are needed to say anything of it."""


@dataclass(frozen=True)
class Analysis:
    """What the study says.

    Attributes:
        rows: One a predictor, then the best single one and the combination, both on held-out objects.
        conditions: One a predictor and part of the table: by hand, friction, mass.
        counts: How many grasps, objects, hands and disturbances, and how many withstood.
    """

    rows: tuple[dict[str, Any], ...]
    conditions: tuple[dict[str, Any], ...]
    counts: Mapping[str, int]


def analyse(frame: pd.DataFrame) -> Analysis:
    """Analyse a table of the study.

    Single predictors have nothing that could be fitted, so every object counts; which of them is best, and
    the combination, are chosen on the other objects' grasps for each fold of objects.

    Args:
        frame: One row a grasp.
    """
    objects = frame["object"].to_numpy(dtype=np.str_)
    columns = predictor_columns(frame)
    force, torque = weakest_force(frame), weakest_torque(frame)
    good = withstands(frame).astype(np.float64)
    folds = folds_of(objects, FOLDS)
    rows = [
        {"predictor": name, **_scores(values, values, force, torque, good, objects)}
        for name, values in columns.items()
    ]
    rows.sort(key=lambda row: -row["spearman"] if np.isfinite(row["spearman"]) else np.inf)
    by_rank = held_out(_best(columns, force, rank_correlations), folds)
    by_area = held_out(_best(columns, good, areas_under_curve), folds)
    rows.append({"predictor": BEST, **_scores(by_rank, by_area, force, torque, good, objects)})
    features = Features({**columns, "friction": frame["friction"].to_numpy(dtype=np.float64)})
    ranks = held_out(lambda train: fitted(ridge, features, force, objects, train), folds)
    odds = held_out(lambda train: fitted(logistic, features, good, objects, train), folds)
    rows.append({"predictor": COMBINED, **_scores(ranks, odds, force, torque, good, objects)})
    disturbances = sum(len(each) for name in ("forces_weight", "torques_weight") for each in frame[name])
    counts = {
        "grasps": len(frame),
        "objects": len(np.unique(objects)),
        "hands": int(frame["hand"].nunique()),
        "disturbances": disturbances,
        "held": int(frame["held"].sum()),
        "withstood": int(good.sum()),
    }
    return Analysis(tuple(rows), tuple(_conditions(frame, columns, ranks, force, objects)), counts)


def _scores(
    for_rank: FloatArray,
    for_area: FloatArray,
    force: FloatArray,
    torque: FloatArray,
    good: FloatArray,
    objects: NDArray[np.str_],
) -> dict[str, Any]:
    return {
        **_interval("spearman", bootstrapped(rank_correlations, for_rank, force, objects)),
        **_interval("torque", bootstrapped(rank_correlations, for_rank, torque, objects)),
        **_interval("auc", bootstrapped(areas_under_curve, for_area, good, objects)),
        "grasps": int(np.count_nonzero(np.isfinite(for_rank))),
    }


def _interval(name: str, found: Interval) -> dict[str, Any]:
    return {name: found.value, f"{name}.low": found.low, f"{name}.high": found.high}


def _best(
    columns: Mapping[str, FloatArray], outcome: FloatArray, score: Score
) -> Callable[[BoolArray], Predict]:
    """Return what chooses the best predictor of the training rows, as quantiles that folds have in common."""
    features = Features(columns)

    def fit(train: BoolArray) -> Predict:
        known = [once(score, values[train], outcome[train]) for values in columns.values()]
        best = int(np.nanargmax(known))
        return lambda rows: np.asarray(features.scaled(train, rows)[:, best])

    return fit


def _conditions(
    frame: pd.DataFrame,
    columns: Mapping[str, FloatArray],
    combined: FloatArray,
    force: FloatArray,
    objects: NDArray[np.str_],
) -> list[dict[str, Any]]:
    """Return each predictor's rank correlation by hand, friction and mass."""
    rows = []
    for key in ("hand", "friction", "mass_kg"):
        for value in sorted(frame[key].unique()):
            part = (frame[key] == value).to_numpy()
            if np.count_nonzero(part) < FEWEST:
                continue
            label = value if isinstance(value, str) else f"{float(value):g}"
            for name, values in (*columns.items(), (COMBINED, combined)):
                found = bootstrapped(rank_correlations, values[part], force[part], objects[part])
                rows.append(
                    {
                        "condition": key,
                        "value": label,
                        "predictor": name,
                        **_interval("spearman", found),
                        "grasps": int(np.count_nonzero(part)),
                    }
                )
    return rows
