"""One trial, run and stored."""

import shutil
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from graspbench.config.trial_config import TrialConfig
from graspbench.errors import InputError, TrialError
from graspbench.record import TrialLog
from graspbench.results.provenance import provenance
from graspbench.results.store import RESULT_FILE, SCHEMA_VERSION, ResultStore, to_json

ERROR_FILE = "error.txt"


def run_and_store(
    config: TrialConfig,
    store: ResultStore,
    *,
    on_stage: Callable[[str, float], None] | None = None,
    contain: bool = False,
) -> dict[str, Any]:
    """Run one trial and write its folder: configuration, result, log and pictures.

    Args:
        config: The trial.
        store: Where its folder goes.
        on_stage: Called with each stage's name and seconds.
        contain: Make a failed trial of every error, as a sweep does, with the traceback in ``error.txt``.

    Returns:
        The content of ``result.json``; status "failed" with the reason when the trial could not be
        finished.

    Raises:
        InputError: What the user gave cannot be used; nothing is written.
    """
    from graspbench.trial.pipeline import run_trial  # loads the simulator

    started, text = time.time(), _yaml(config)
    with store.writing(config.trial_id) as folder:
        (folder / "config.yaml").write_text(text, encoding="utf-8")
        try:
            with TrialLog(folder / "trial.mcap", config.record) as log:
                log.attach("config.yaml", text)
                log.metadata("trial", {"trial_id": config.trial_id, "schema": SCHEMA_VERSION})
                listener = _listener(log, on_stage)
                outcome = run_trial(config, log=log, picture_dir=folder, on_stage=listener)
            result = {**_header(config, "done", None), **outcome}
        except Exception as error:
            if isinstance(error, InputError) and not contain:
                raise
            if not isinstance(error, TrialError) and not contain:
                raise
            (folder / ERROR_FILE).write_text(traceback.format_exc(), encoding="utf-8")
            result = {**_header(config, "failed", _reason(error)), "success": False}
        result["provenance"] = provenance(started)
        (folder / RESULT_FILE).write_text(to_json(result), encoding="utf-8")
    return result


def failed_result(
    config: TrialConfig, store: ResultStore, status: str, reason: str, details: str | None = None
) -> dict[str, Any]:
    """Store the result of a trial whose process did not live to store it, with its cut log; return it."""
    result = {**_header(config, status, reason), "success": False, "provenance": provenance()}
    remains = store.remains(config.trial_id)
    with store.writing(config.trial_id) as folder:
        (folder / "config.yaml").write_text(_yaml(config), encoding="utf-8")
        for log in (path for left in remains for path in left.glob("*.mcap.partial")):
            shutil.copyfile(log, folder / log.name)
        if details:
            (folder / ERROR_FILE).write_text(details, encoding="utf-8")
        (folder / RESULT_FILE).write_text(to_json(result), encoding="utf-8")
    return result


def fault_file(root: Path, trial_id: str) -> Path:
    """Return where a worker's last traceback goes when a signal or the time limit ends it."""
    return root / f".{trial_id}.fault"


def _listener(log: TrialLog, on_stage: Callable[[str, float], None] | None) -> Callable[[str, float], None]:
    """Return a listener that also logs each stage's end, so that a log that is cut shows how far it came."""

    def listen(stage: str, seconds: float) -> None:
        log.message(f"{stage} done", level="debug", stage=stage)
        if on_stage is not None:
            on_stage(stage, seconds)

    return listen


def _reason(error: Exception) -> str:
    if isinstance(error, MemoryError):
        return "memory: the trial needed more than its limit."
    if isinstance(error, InputError | TrialError):
        return str(error)
    return f"unexpected {type(error).__name__}: {error}"


def _header(config: TrialConfig, status: str, reason: str | None) -> dict[str, Any]:
    tree = config.as_tree()
    return {
        "schema": SCHEMA_VERSION,
        "kind": "trial",
        "trial_id": config.trial_id,
        "status": status,
        "reason": reason,
        "seed": config.seed,
        "object": {"name": tree["object"]["name"]},
        "hand": {"name": tree["hand"]["name"], "fingers": tree["hand"]["fingers"]},
        "index": tree["index"],
        "stations": tree["stations"],
    }


def _yaml(config: TrialConfig) -> str:
    text: str = yaml.safe_dump(config.as_tree(), sort_keys=False, allow_unicode=True)
    return text
