"""Trials as runs of MLflow, in local files: what was asked for, what came of it, pictures and records."""

import logging
import math
import os
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Any, Protocol

import pandas as pd

from graspbench.errors import ConfigurationError, OutputError, sentence
from graspbench.report import columns as c
from graspbench.report.page_media import shown_files
from graspbench.results.store import RESULT_FILE, LoadedResults, is_own_file, writable

DATABASE, ARTIFACTS = "mlflow.db", "artifacts"
_RUN_STATES = {c.DONE: "FINISHED", "timeout": "KILLED"}
_TRIAL_TAG, _CONTENT_TAG = "graspbench.trial_id", "graspbench.content"
_RECORDS = (RESULT_FILE, "config.yaml", "error.txt")
_MAX_FILE_BYTES = 100_000_000
# What MLflow takes of one run at a time, and of one value.
_AT_ONCE = {"metrics": 1000, "params": 100, "tags": 100}
_MAX_PARAMETER, _MAX_TAG, _MAX_NAME = 6000, 5000, 250


class _Client(Protocol):
    """What is asked of MLflow's client."""

    def get_experiment_by_name(self, name: str) -> Any: ...
    def create_experiment(self, name: str, artifact_location: str) -> str: ...
    def search_runs(self, experiment_ids: list[str], **more: Any) -> Any: ...
    def create_run(self, experiment_id: str, **more: Any) -> Any: ...
    def delete_run(self, run_id: str) -> None: ...
    def log_batch(self, run_id: str, **more: Any) -> Any: ...
    def log_artifact(self, run_id: str, local_path: str) -> None: ...
    def set_terminated(self, run_id: str, status: str, end_time: int) -> None: ...


def export_to_mlflow(
    trials: pd.DataFrame, loaded: LoadedResults, folder: Path, name: str
) -> tuple[Path, int]:
    """Write trials as runs of one experiment of MLflow.

    A run has the trial's settings as parameters, its numbers as metrics, its state and reason as tags, and
    its result, configuration and pictures as artifacts. Runs that are there already are left as they are;
    those of trials that were run again since are replaced.

    Args:
        trials: One row a trial, dotted column names as in ``trials.csv``.
        loaded: Where the trials' folders are.
        folder: Where MLflow's database and artifacts go; made if need be.
        name: The experiment's.

    Returns:
        The database, and how many runs were written.

    Raises:
        ConfigurationError: MLflow is not installed, or the folder's path is none that it takes.
        OutputError: The folder cannot be written, or its database is not MLflow's.
    """
    if set(str(folder.resolve())) & set("?#%"):
        raise ConfigurationError(
            f"--mlflow {folder}: MLflow takes no folder with ?, # or % in its path", remedy="choose another"
        )
    with writable(folder):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ARTIFACTS).mkdir(exist_ok=True)
    database = folder / DATABASE
    with _mlflow(database) as client:
        experiment = _experiment(client, name, folder / ARTIFACTS)
        there = _runs(client, experiment)
        asked = c.settings(trials)
        written = 0
        for row in trials.to_dict("records"):
            trial_id = str(row[c.TRIAL_ID])
            place = Path(loaded.folders[trial_id])
            content = _content(place)
            run_id, known = there.get(trial_id, (None, None))
            if run_id is not None and known == content:
                continue
            if run_id is not None:
                client.delete_run(run_id)
            _write_run(
                client, experiment, {str(key): each for key, each in row.items()}, asked, content, place
            )
            written += 1
    return database, written


@contextmanager
def _mlflow(database: Path) -> Iterator[_Client]:
    """Give MLflow's client of a database; it says nothing, and tells nobody."""
    os.environ["MLFLOW_DISABLE_TELEMETRY"] = "true"
    logger = logging.getLogger("mlflow")
    before = logger.level
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            from mlflow.exceptions import MlflowException
            from mlflow.tracking import MlflowClient
        except ImportError as error:
            raise ConfigurationError(
                "MLflow is not installed", remedy="pip install mlflow-skinny (or mlflow, to look at the runs)"
            ) from error
        from sqlalchemy.exc import SQLAlchemyError

        logger.setLevel(logging.ERROR)
        try:
            yield MlflowClient(tracking_uri=f"sqlite:///{database.resolve()}")
        except (MlflowException, SQLAlchemyError, OSError) as error:
            raise OutputError(
                f"the runs cannot be written to {database} ({sentence(str(error), 300)})",
                remedy="choose another folder",
                path=database,
            ) from error
        finally:
            logger.setLevel(before)


def _experiment(client: _Client, name: str, artifacts: Path) -> str:
    found = client.get_experiment_by_name(name)
    if found is not None:
        return str(found.experiment_id)
    return client.create_experiment(name, artifact_location=artifacts.resolve().as_uri())


def _runs(client: _Client, experiment: str) -> dict[str, tuple[str, str | None]]:
    """Return the runs that are there: trial id -> run and what it was written from."""
    found, token = {}, None
    while True:
        page = client.search_runs([experiment], max_results=1000, page_token=token)
        for run in page:
            if (trial_id := run.data.tags.get(_TRIAL_TAG)) is not None:
                found[trial_id] = (run.info.run_id, run.data.tags.get(_CONTENT_TAG))
        token = page.token
        if not token:
            return found


def _content(place: Path) -> str:
    """Return a digest of a trial's result; empty for one that cannot be read."""
    path = place / RESULT_FILE
    if not is_own_file(path) or path.stat().st_size > _MAX_FILE_BYTES:
        return ""
    return sha256(path.read_bytes()).hexdigest()[:16]


def _write_run(
    client: _Client, experiment: str, row: dict[str, Any], asked: Sequence[str], content: str, place: Path
) -> None:
    from mlflow.entities import Metric, Param, RunTag

    finished = _milliseconds(row.get("provenance.finished"))
    started = finished - round(1000.0 * (_number(row.get("provenance.seconds")) or 0.0))
    trial_id, status = str(row[c.TRIAL_ID]), str(row[c.STATUS])
    run = client.create_run(experiment, start_time=started, run_name=trial_id)
    run_id = run.info.run_id
    tags = {_TRIAL_TAG: trial_id, "graspbench.status": status}
    for name in (c.REASON, c.VERSION, c.COMMIT):
        if not _missing(row.get(name)):
            tags[f"graspbench.{name.rpartition('.')[2]}"] = str(row[name])[:_MAX_TAG]
    settings = {_name(key): str(row[key])[:_MAX_PARAMETER] for key in asked if not _missing(row.get(key))}
    numbers = {
        _name(key): number
        for key, each in row.items()
        if key not in asked and (number := _number(each)) is not None
    }
    kinds: dict[str, list[Any]] = {
        "metrics": [Metric(key, value, finished, 0) for key, value in numbers.items()],
        "params": [Param(key, value) for key, value in settings.items()],
        "tags": [RunTag(key, value) for key, value in tags.items()],
    }
    for kind, entries in kinds.items():
        for first in range(0, len(entries), _AT_ONCE[kind]):
            client.log_batch(run_id, **{kind: entries[first : first + _AT_ONCE[kind]]})
    for path in [*(place / name for name in _RECORDS), *shown_files(place)]:
        if is_own_file(path) and path.stat().st_size <= _MAX_FILE_BYTES:
            client.log_artifact(run_id, str(path))
    # Last: what was written in part is written again.
    client.log_batch(run_id, tags=[RunTag(_CONTENT_TAG, content)])
    client.set_terminated(run_id, status=_RUN_STATES.get(status, "FAILED"), end_time=finished)


def _name(column: str) -> str:
    """Return a column's name with what MLflow takes in names only."""
    return re.sub(r"[^\w\-. /]", "_", column, flags=re.ASCII).strip("/. ")[:_MAX_NAME] or "_"


def _number(value: Any) -> float | None:
    if hasattr(value, "item"):
        value = value.item()
    if not isinstance(value, bool | int | float):
        return None
    try:
        number = float(value)
    except OverflowError:  # a whole number may have any length
        return None
    return number if math.isfinite(number) else None


def _missing(value: Any) -> bool:
    return value is None or value is pd.NA or (isinstance(value, float) and value != value)


def _milliseconds(stamp: Any) -> int:
    """Return a time stamp as MLflow has it; now's for none."""
    try:
        moment = datetime.fromisoformat(str(stamp))
        return round(1000.0 * moment.timestamp())
    except (ValueError, OverflowError):
        return round(1000.0 * datetime.now().timestamp())
