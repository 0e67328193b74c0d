"""The comparison of local and global grasps (thesis table 3.1)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from graspbench.errors import LogError
from graspbench.grasp.quality import THESIS_MEASURES

THESIS_3_1: dict[tuple[int, str], tuple[tuple[float, float], ...]] = {
    (1, "bottle"): ((0.016, 0.016), (0.091, 0.101), (0.438, 0.438)),
    (1, "teddy"): ((0.292, 0.320), (0.536, 0.690), (0.426, 0.482)),
    (0, "bottle"): ((0.019, 0.020), (0.099, 0.112), (0.574, 0.590)),
    (0, "teddy"): ((0.267, 0.297), (0.369, 0.413), (0.707, 0.780)),
}
"""(k_cm, object) -> (local, global) of Q1, Q2, Q3 as printed in thesis table 3.1.

Only the ratios can be set beside ours: the thesis does not say in which contact model and with which
unit of torque its values were taken.
"""


@dataclass(frozen=True)
class Cell:
    """One measure of one row.

    Attributes:
        local: Mean value of the local planner's grasps, nan if there is none.
        best: Mean value of the global search's grasps, nan if there is none.
        ratio: Mean of local / global over the trials, nan if there is none.
        thesis: The ratio in the thesis, nan if it has none.
    """

    local: float
    best: float
    ratio: float
    thesis: float


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        k_cm: Gain that pulls the grasp plane to the centroid; None for an index without it.
        index: Name of the local planner's index.
        object: Name of the object.
        hand: Name of the hand.
        fingers: Number of fingers.
        trials: Number of finished trials in the means.
        failed: Number of trials that ended without a grasp.
        cells: Q1, Q2, Q3.
    """

    k_cm: float | None
    index: str
    object: str
    hand: str
    fingers: int
    trials: int
    failed: int
    cells: tuple[Cell, Cell, Cell]


def comparison_table(trials: pd.DataFrame) -> tuple[Row, ...]:
    """Gather trials into rows of thesis table 3.1: k_cm (1 first), then object.

    Trials that differ in seed or pose only are averaged; so are all other differences that no
    column of the table shows.

    Args:
        trials: One row a trial, dotted column names as in ``trials.csv``.

    Raises:
        LogError: The table has no trial, or lacks the columns that name one.
    """
    needed = ["object.name", "hand.name", "hand.fingers", "index.name", "status"]
    missing = [name for name in needed if name not in trials]
    if missing or trials.empty:
        problem = f"lack the column {missing[0]}" if missing else "are none"
        raise LogError(f"the trials {problem}", remedy="give a folder that run or sweep has written")
    table = trials.copy()
    table["k_cm"] = table.get("index.k_cm", np.nan)
    keys = ["k_cm", "index.name", "object.name", "hand.name", "hand.fingers"]
    rows = [
        _row(key if isinstance(key, tuple) else (key,), group)
        for key, group in table.groupby(keys, dropna=False, sort=True)
    ]
    rows.sort(
        key=lambda row: (
            row.index,
            -1.0 if row.k_cm is None else -row.k_cm,
            row.object,
            row.hand,
            row.fingers,
        )
    )
    return tuple(rows)


def _row(key: tuple[Any, ...], group: pd.DataFrame) -> Row:
    k_cm, index, name, hand, fingers = key
    done = group[group["status"] == "done"]
    gain = None if pd.isna(k_cm) else float(k_cm)
    printed = THESIS_3_1.get((round(gain), name)) if gain in (0.0, 1.0) and index == "force_field" else None
    cells = []
    for i, measure in enumerate(THESIS_MEASURES):
        thesis = printed[i][0] / printed[i][1] if printed else np.nan
        local = _mean(done, f"local.{measure}")
        best = _mean(done, f"global.{measure}.value")
        cells.append(Cell(local, best, _mean(done, f"ratio.{measure}"), thesis))
    return Row(
        gain, str(index), str(name), str(hand), int(fingers), len(done), len(group) - len(done),
        (cells[0], cells[1], cells[2]),
    )  # fmt: skip


def _mean(trials: pd.DataFrame, column: str) -> float:
    if column not in trials:
        return np.nan
    values = pd.to_numeric(trials[column], errors="coerce").dropna()
    return float(values.mean()) if len(values) else np.nan
