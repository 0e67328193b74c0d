"""What the columns of trials are called, and which of them say what was asked for.

Everything else in this package asks here for a column of ``trials.csv`` that it must know by name.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pandas as pd

from graspbench.grasp.quality import THESIS_MEASURES
from graspbench.results.columns import OVERRIDDEN, describe_column

TRIAL_ID, STATUS, REASON, SUCCESS, SEED = "trial_id", "status", "reason", "success", "seed"
FOLDER = "folder"
OBJECT, HAND, FINGERS = "object.name", "hand.name", "hand.fingers"
INDEX, GAIN = "index.name", "index.k_cm"
PLANNER_OPTION = "choice.planner"
PLANNING_TIME = "local.time_s"
VERSION, COMMIT, DIRTY = "provenance.graspbench", "provenance.git.commit", "provenance.git.dirty"
MEASURES = THESIS_MEASURES
STRENGTHENED, EXPLORED = "strengthened.q3", "explored.value"
CONTACT, PLANNED_FRICTION, EXECUTED_FRICTION = "quality.contact", "quality.friction", "execution.friction"
WRENCH_SPACE, TORQUE_LENGTH = "quality.wrench_space", "quality.torque_length"
DONE, UNREADABLE = "done", "unreadable"

_RATIOS = tuple(f"ratio.{measure}" for measure in MEASURES)
_LOCALS = tuple(f"local.{measure}" for measure in MEASURES)
QUALITIES = (*_LOCALS, *_RATIOS)
SUMMARISED = (*_RATIOS, PLANNING_TIME)
COMPARED = (SUCCESS, *_LOCALS, *_RATIOS, PLANNING_TIME)

# Of a result's own columns these say what was asked for; of the others what came of it.
_NAMED = ("choice.", "index.")
_ASKED = frozenset({OBJECT, HAND, FINGERS, SEED, "kind"})
# What is kept of a trial does not change it.
_NO_MATTER = ("record", "engine", "experiment")
_PHYSICS_OUTCOMES = ("slip_m", "drift_m", "turn_deg", "push_weight")
# What a grasp is planned for, in contrast to how.
_PROBLEMS = ("object", "scene")


def global_value(measure: str) -> str:
    """Return the column of a measure's global optimum."""
    return f"global.{measure}.value"


@cache
def is_setting(name: str) -> bool:
    """Tell whether a column says what was asked for, rather than what came of it."""
    if _section(name) in _NO_MATTER or name == FOLDER:
        return False
    return name in _ASKED or name.startswith(_NAMED) or describe_column(name) is None


def is_problem(name: str) -> bool:
    """Tell whether a column says what the task was: the object, its scene, the seed."""
    return name == SEED or _section(name) in _PROBLEMS


def physics_outcomes(trials: pd.DataFrame) -> list[str]:
    """Return the columns that say what physics made of a grasp."""
    return [
        str(name)
        for name in trials.columns
        if name == SUCCESS or (str(name).startswith("execution.") and str(name).endswith(_PHYSICS_OUTCOMES))
    ]


def settings(trials: pd.DataFrame) -> list[str]:
    """Return the columns that say what was asked for: names and choices first, the seed last."""
    asked = set(trials.attrs.get(OVERRIDDEN, ()))
    found = [str(name) for name in trials.columns if str(name) in asked or is_setting(str(name))]

    def rank(name: str) -> int:
        if name == SEED:
            return 3
        return 0 if name.endswith(".name") else 1 if name.startswith("choice.") else 2

    return sorted(found, key=rank)


def differing(trials: pd.DataFrame, shown: Sequence[str] = ()) -> list[str]:
    """Return the settings in which trials differ that are alike in ``shown``.

    A setting that follows from another of its section is not named beside it: where trials differ in the
    index, they differ in its options too.

    Args:
        trials: One row a trial.
        shown: Columns that a table tells its rows apart by.
    """
    keys = [name for name in shown if name in trials]
    found: list[str] = []
    for name in settings(trials):
        if name in keys:
            continue
        alike = [*keys, *(other for other in found if _section(other) == _section(name))]
        if _varies(trials, name, alike):
            found.append(name)
    return found


def numbers(trials: pd.DataFrame, name: str) -> pd.Series:
    """Return a column as numbers, nan where it is empty or no number; a lack of it is all empty."""
    if name not in trials:
        return pd.Series(np.nan, index=trials.index, dtype=float)
    values = trials[name]
    if values.dtype == object:
        values = values.map(lambda value: float(value) if isinstance(value, bool | np.bool_) else value)
    return pd.to_numeric(values, errors="coerce").astype(float)


def _varies(trials: pd.DataFrame, name: str, alike: Sequence[str]) -> bool:
    values = trials[name].map(str)
    if not alike:
        return bool(values.nunique() > 1)
    keys = [trials[key].map(str) for key in alike]
    return bool((values.groupby(keys).nunique() > 1).any())


def _section(name: str) -> str:
    section, _, option = name.partition(".")
    return option.partition("/")[0] if section == "choice" else section
