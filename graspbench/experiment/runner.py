"""One trial, run and stored."""

from collections.abc import Callable
from typing import Any

import yaml

from graspbench.errors import InputError, TrialError
from graspbench.experiment.config import TrialConfig
from graspbench.experiment.provenance import provenance
from graspbench.experiment.store import RESULT_FILE, SCHEMA_VERSION, ResultStore, to_json
from graspbench.experiment.trial import run_trial
from graspbench.record import TrialLog


def run_and_store(
    config: TrialConfig, store: ResultStore, *, on_stage: Callable[[str, float], None] | None = None
) -> dict[str, Any]:
    """Run one trial and write its folder: configuration, result, log and pictures.

    Args:
        config: The trial.
        store: Where its folder goes.
        on_stage: Called with each stage's name and seconds.

    Returns:
        The content of ``result.json``; status "failed" with the reason when the trial could not be
        finished.

    Raises:
        InputError: What the user gave cannot be used; nothing is written.
    """
    with store.writing(config.trial_id) as folder:
        (folder / "config.yaml").write_text(_yaml(config), encoding="utf-8")
        try:
            with TrialLog(folder / "trial.mcap", config.record.level) as log:
                log.attach("config.yaml", _yaml(config))
                outcome = run_trial(config, log=log, picture_dir=folder, on_stage=on_stage)
            result = {**_header(config, "done", None), **outcome}
        except InputError:
            raise
        except TrialError as error:
            result = {**_header(config, "failed", str(error)), "success": False}
        result["provenance"] = provenance()
        (folder / RESULT_FILE).write_text(to_json(result), encoding="utf-8")
    return result


def failed_result(
    config: TrialConfig, store: ResultStore, status: str, reason: str, details: str | None
) -> dict[str, Any]:
    """Store the result of a trial that could not be finished and return it."""
    result = {**_header(config, status, reason), "success": False, "provenance": provenance()}
    with store.writing(config.trial_id) as folder:
        (folder / "config.yaml").write_text(_yaml(config), encoding="utf-8")
        if details:
            (folder / "error.txt").write_text(details, encoding="utf-8")
        (folder / RESULT_FILE).write_text(to_json(result), encoding="utf-8")
    return result


def _header(config: TrialConfig, status: str, reason: str | None) -> dict[str, Any]:
    tree = config.as_tree()
    return {
        "schema": SCHEMA_VERSION,
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
