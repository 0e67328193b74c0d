"""Search over parameters: which values of numeric options make a measure best, over a grid of trials."""

import hashlib
import json
import math
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from hydra.core.override_parser.types import IntervalSweep, Override

from graspbench.config.overrides import parse_override
from graspbench.errors import ConfigurationError, LogError, sentence, shown
from graspbench.results.columns import results_frame
from graspbench.results.store import ResultStore, open_for_appending, writable
from graspbench.sweep.grid import SweepOptions, plan_sweep, run_sweep

if TYPE_CHECKING:
    import optuna

STUDY_FILE = "study.db"
_DIGITS = 6
_WAIT_S = 60.0
_MAX_REASON = 200
_MAX_BOUND = 1e15


@dataclass(frozen=True)
class Axis:
    """One option that is searched.

    Attributes:
        key: Its dotted name.
        low: Smallest value.
        high: Largest value.
        whole: Whether only whole numbers are tried.
        log: Whether values are spread evenly over orders of magnitude.
    """

    key: str
    low: float
    high: float
    whole: bool
    log: bool


@dataclass(frozen=True)
class TuneOptions:
    """What is sought, and how long.

    Attributes:
        measure: Column of ``trials.csv`` whose mean over the grid is the score.
        direction: Which scores are better.
        candidates: How many value sets to try in all, those of earlier runs included.
        failed: What a trial without the measure counts; None gives a candidate with such a trial up.
        seed: Of the search.
    """

    measure: str
    direction: Literal["maximize", "minimize"] = "maximize"
    candidates: int = 20
    failed: float | None = None
    seed: int = 0


def split_axes(overrides: Sequence[str]) -> tuple[list[Axis], list[str]]:
    """Return the options that an override gives an interval, and the other overrides.

    Hydra's grammar: ``index.k_e=interval(0.1,10)``, ``index.k_e=tag(log,interval(0.1,10))``,
    ``planner.planes=int(interval(1,8))``.

    Raises:
        ConfigurationError: An override cannot be read, an interval is empty, or there is none.
    """
    axes, grid = [], []
    for text in overrides:
        override = parse_override(text, "write key=value or key=interval(low,high)")
        value = override.value()
        if isinstance(value, IntervalSweep):
            axes.append(_axis(override, value))
        else:
            grid.append(text)
    if not axes:
        raise ConfigurationError(
            "there is nothing to tune", remedy="give an option an interval: index.k_e=interval(0.1,10)"
        )
    return axes, grid


def run_tuning(
    axes: Sequence[Axis],
    grid: Sequence[str],
    store: ResultStore,
    options: TuneOptions,
    sweep: SweepOptions,
    config_dir: Path | None = None,
    on_candidate: Callable[[dict[str, Any]], None] | None = None,
) -> "optuna.Study":
    """Try values by Optuna's tree-structured Parzen estimator until enough candidates are finished.

    The study is kept in ``study.db`` beside the trials: the same call goes on where it was stopped, and no
    trial is run twice.

    Args:
        axes: What is searched.
        grid: Overrides of the trials that every candidate is judged by, sweeps allowed.
        store: The results folder.
        options: What is sought.
        sweep: How the trials are run.
        config_dir: A user's folder with further options.
        on_candidate: Called with each finished candidate.
    """
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    plan_sweep(
        [*grid, *axis_overrides(axes, {axis.key: axis.low for axis in axes})], store, sweep, config_dir
    )
    with writable(store.root):
        store.root.mkdir(parents=True, exist_ok=True)
    with _readable_study(store.root / STUDY_FILE) as storage:
        study = optuna.create_study(
            storage=storage,
            study_name=_study_name(axes, grid, options),
            direction=options.direction,
            load_if_exists=True,
        )
        _free_unfinished(study)
        while len(study.trials) < options.candidates and not sweep.stop.is_set():
            # A sampler keeps no state: its draws follow from the seed and the number of earlier candidates.
            study.sampler = optuna.samplers.TPESampler(seed=options.seed + len(study.trials))
            candidate = study.ask()
            values = {axis.key: _suggest(candidate, axis) for axis in axes}
            score, trials = _score([*grid, *axis_overrides(axes, values)], store, options, sweep, config_dir)
            if sweep.stop.is_set():
                break
            state = optuna.trial.TrialState.COMPLETE if score is not None else optuna.trial.TrialState.FAIL
            study.tell(candidate, score, state=state)
            if on_candidate is not None:
                rounded = {key: float(f"{value:.{_DIGITS}g}") for key, value in values.items()}
                on_candidate(
                    {"candidate": candidate.number, options.measure: score, "trials": trials, **rounded}
                )
    return study


@contextmanager
def _readable_study(path: Path) -> Iterator["optuna.storages.RDBStorage"]:
    """Give the study's file; its path may have any characters, so that it is no part of an address.

    Raises:
        LogError: The file is no study, or is damaged.
        OutputError: It cannot be written.
    """
    import optuna
    from sqlalchemy.exc import SQLAlchemyError
    from sqlalchemy.pool import NullPool

    def connect() -> sqlite3.Connection:
        return sqlite3.connect(path, timeout=_WAIT_S)

    with writable(path):
        open_for_appending(path).close()
    try:
        yield optuna.storages.RDBStorage(
            "sqlite://", engine_kwargs={"creator": connect, "poolclass": NullPool}
        )
    except (SQLAlchemyError, optuna.exceptions.OptunaError, sqlite3.Error, RuntimeError) as error:
        reason = sentence(str(getattr(error, "orig", None) or error), _MAX_REASON)
        raise LogError(
            f"the study {path} cannot be used ({reason})",
            remedy="move it away: the trials that are finished are found again",
            path=path,
        ) from error


def _axis(override: Override, interval: IntervalSweep) -> Axis:
    low, high = interval.start, interval.end
    if any(bound is not None and not abs(bound) <= _MAX_BOUND for bound in (low, high)):
        raise ConfigurationError(
            f"'{override.input_line}' is endless", remedy=f"give bounds of at most {_MAX_BOUND:g}"
        )
    if low is None or high is None or not low < high:
        raise ConfigurationError(
            f"'{override.input_line}' is an empty interval", remedy="write interval(low,high)"
        )
    log = "log" in interval.tags
    if log and low <= 0:
        raise ConfigurationError(
            f"'{override.input_line}' reaches zero, which has no logarithm", remedy="start above 0"
        )
    whole = (override.input_line or "").split("=", 1)[1].startswith("int(")
    return Axis(override.key_or_group, float(low), float(high), whole, log)


def _suggest(candidate: "optuna.Trial", axis: Axis) -> float:
    if axis.whole:
        return int(candidate.suggest_int(axis.key, round(axis.low), round(axis.high), log=axis.log))
    return float(candidate.suggest_float(axis.key, axis.low, axis.high, log=axis.log))


def axis_overrides(axes: Sequence[Axis], values: Mapping[str, float]) -> list[str]:
    """Write values with few digits, so that a candidate's trials are found again."""
    return [
        f"{axis.key}={round(values[axis.key]) if axis.whole else format(values[axis.key], f'.{_DIGITS}g')}"
        for axis in axes
    ]


def _score(
    overrides: list[str],
    store: ResultStore,
    options: TuneOptions,
    sweep: SweepOptions,
    config_dir: Path | None,
) -> tuple[float | None, int]:
    """Run a candidate's trials; return the measure's mean (None if a trial lacks it) and their number."""
    trials = plan_sweep(overrides, store, sweep, config_dir)
    for _ in run_sweep(trials, store, sweep):
        pass
    results = [found for trial in trials if (found := store.result(trial.config.trial_id))]
    frame = results_frame(results)
    if options.measure not in frame:
        if all(result.status == "done" for result in results) and results:
            raise ConfigurationError(
                f"the trials have no column '{options.measure}'", remedy="choose one of trials.csv"
            )
        column: list[Any] = [None] * len(results)
    else:
        column = frame[options.measure].tolist()
    values = [_number(value, options.measure, options.failed) for value in column]
    if any(value is None for value in values) or not values:
        return None, len(trials)
    return sum(value for value in values if value is not None) / len(values), len(trials)


def _number(value: Any, measure: str, failed: float | None) -> float | None:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return failed
    if not isinstance(value, int | float):
        raise ConfigurationError(
            f"the column '{measure}' holds {shown(value)}, no numbers", remedy="choose a column of numbers"
        )
    return float(value)


def _free_unfinished(study: "optuna.Study") -> None:
    """Close candidates that an earlier run was killed over; their finished trials are found again."""
    import optuna

    for candidate in study.get_trials(states=(optuna.trial.TrialState.RUNNING,)):
        study.tell(candidate.number, state=optuna.trial.TrialState.FAIL)


def _study_name(axes: Sequence[Axis], grid: Sequence[str], options: TuneOptions) -> str:
    """Name a study by what makes its scores comparable: another search in the folder is another study."""
    identity = [[vars(axis) for axis in axes], list(grid), options.measure, options.direction, options.failed]
    return hashlib.sha256(json.dumps(identity).encode()).hexdigest()[:12]
