"""One trial of any kind, run and stored."""

import dataclasses
import shutil
import time
import traceback
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Protocol

from graspbench.beside import Beside
from graspbench.config.trial_config import TrialConfig
from graspbench.errors import GraspbenchError, InputError, TrialError, sentence
from graspbench.geometry import object_name
from graspbench.record import TrialLog
from graspbench.results.plain import to_json
from graspbench.results.provenance import provenance
from graspbench.results.store import (
    NO_ROOM,
    RESULT_FILE,
    SCHEMA_VERSION,
    ResultStore,
    is_own_file,
    no_room,
    writable,
)
from graspbench.results.traces import without_places
from graspbench.results.trial_result import HandResult, ObjectResult, Status, TrialResult
from graspbench.trial.clock import StageClock, Watch
from graspbench.trial.drawer import drawer

CONFIG_FILE = "config.yaml"
ERROR_FILE = "error.txt"
_MAX_REASON = 1000

Listener = Callable[[str, float], None]
"""Called with each stage's name and seconds."""


class Procedure(Protocol):
    """What a kind of trial does, from its configuration to its result."""

    def __call__(
        self,
        config: TrialConfig,
        started: TrialResult,
        log: TrialLog,
        folder: Path | None,
        clock: StageClock,
        beside: Beside,
        /,
    ) -> TrialResult:
        """Run the trial; return its result without times and provenance, which the runner adds.

        Args:
            config: What to run.
            started: What is known of the trial before anything came of it, to be completed.
            log: Where to record it, stage by stage.
            folder: Where further files go; None writes none.
            clock: Times the stages.
            beside: Draws pictures (`graspbench.trial.pictures`) while the trial goes on.

        Raises:
            InputError: What the configuration names cannot be used.
            TrialError: The trial failed on its way; the message says where and why.
        """


# By kind: the module, loaded on first use since it loads the simulator, the log's name, and whether pictures
# can be drawn while the trial goes on.
_PROCEDURES = {
    "trial": ("graspbench.trial.pipeline", "run_grasp", "trial.mcap", True),
    "manipulation": ("graspbench.trial.in_hand", "run_in_hand", "manipulation.mcap", False),
}


def run_trial(
    config: TrialConfig,
    *,
    log: TrialLog | None = None,
    picture_dir: Path | None = None,
    on_stage: Listener | None = None,
    watch: Watch | None = None,
    beside: Beside | None = None,
) -> TrialResult:
    """Run one trial, a grasp or an in-hand motion; nothing is stored.

    Args:
        config: What to run.
        log: Where to record it, stage by stage; None records nothing.
        picture_dir: Where its pictures go; None draws none.
        on_stage: Called with each stage's name and seconds.
        watch: Is told, as the trial goes on, what it is at.
        beside: As for `run_and_store`.

    Raises:
        InputError: What the configuration names cannot be used.
        TrialError: The trial failed on its way; the message says where and why.
    """
    module, name, _, early = _PROCEDURES[config.kind]
    clock = StageClock(on_stage, watch)
    if beside is not None and not (early and config.record.pictures):
        beside.stop()
    with beside or drawer(beside=False) as beside:
        with clock.watch.at("loading"):
            procedure: Procedure = getattr(import_module(module), name)
        no_log = TrialLog(Path("unused.mcap"), "off")
        result = procedure(config, _started(config), log or no_log, picture_dir, clock, beside)
    return dataclasses.replace(result, times_s=dict(clock.seconds), compiled=tuple(clock.compiled))


def run_and_store(
    config: TrialConfig,
    store: ResultStore,
    *,
    on_stage: Listener | None = None,
    watch: Watch | None = None,
    contain: bool = False,
    beside: Beside | None = None,
) -> TrialResult:
    """Run one trial and write its folder: configuration, result, log and pictures.

    Args:
        config: The trial, a grasp or an in-hand motion.
        store: Where its folder goes.
        on_stage: Called with each stage's name and seconds.
        watch: Is told, as the trial goes on, what it is at.
        contain: Make a failed trial of every error, as a sweep does, with the traceback in ``error.txt``.
        beside: Draws the pictures, from `graspbench.trial.drawer`; None draws them here.

    Returns:
        The content of ``result.json``; status "failed" with the reason when the trial could not be
        finished.

    Raises:
        InputError: What the user gave cannot be used; nothing is written.
    """
    started, text = time.time(), config.as_yaml()
    with store.writing(config.trial_id) as folder:
        with writable(folder):
            (folder / CONFIG_FILE).write_text(text, encoding="utf-8")
        try:
            with TrialLog(folder / _PROCEDURES[config.kind][2], config.record) as log:
                log.attach(CONFIG_FILE, text)
                log.metadata("trial", {"trial_id": config.trial_id, "schema": SCHEMA_VERSION})
                result = run_trial(
                    config,
                    log=log,
                    picture_dir=folder,
                    on_stage=_logged(log, on_stage),
                    watch=watch,
                    beside=beside,
                )
        except Exception as error:
            if isinstance(error, OSError) and error.errno in NO_ROOM:
                raise no_room(folder, error) from error  # the disk's failure, not the trial's
            if not contain and (isinstance(error, InputError) or not isinstance(error, TrialError)):
                raise
            with writable(folder):
                (folder / ERROR_FILE).write_text(without_places(traceback.format_exc()), encoding="utf-8")
            result = _unfinished(config, "failed", _reason(error))
        result = dataclasses.replace(result, provenance=provenance(started, config.record.host))
        with writable(folder):
            (folder / RESULT_FILE).write_text(to_json(result), encoding="utf-8")
    return result


def failed_result(
    config: TrialConfig, store: ResultStore, status: Status, reason: str, details: str | None = None
) -> TrialResult:
    """Store the result of a trial whose process did not live to store it, with its cut log; return it."""
    result = dataclasses.replace(
        _unfinished(config, status, reason), provenance=provenance(host=config.record.host)
    )
    remains = store.remains(config.trial_id)
    with store.writing(config.trial_id) as folder, writable(folder):
        (folder / CONFIG_FILE).write_text(config.as_yaml(), encoding="utf-8")
        for log in (path for left in remains for path in left.glob("*.mcap.partial")):
            if is_own_file(log):
                shutil.copyfile(log, folder / log.name)
        if details:
            (folder / ERROR_FILE).write_text(without_places(details), encoding="utf-8")
        (folder / RESULT_FILE).write_text(to_json(result), encoding="utf-8")
    return result


def fault_file(root: Path, trial_id: str) -> Path:
    """Return where a worker's last traceback goes when a signal or the time limit ends it."""
    return root / f".{trial_id}.fault"


def _started(config: TrialConfig) -> TrialResult:
    """Return the result of a trial that is done, before anything came of it."""
    tree = config.as_tree()
    return TrialResult(
        trial_id=config.trial_id,
        status="done",
        seed=config.seed,
        kind=config.kind,
        schema=SCHEMA_VERSION,
        choice=dict(config.choice),
        overridden=config.overridden,
        config=tree,
        object=ObjectResult(_object_name(config)),
        hand=HandResult(str(tree["hand"]["name"]), int(tree["hand"]["fingers"])),
        index=tree["index"],
    )


def _object_name(config: TrialConfig) -> str:
    """Return what the object is called even if it turns out that it cannot be loaded."""
    try:
        return object_name(config.object)
    except (GraspbenchError, OSError):
        return config.object.name


def _executes(config: TrialConfig) -> bool:
    """Tell whether a trial is to end in physics, so that success can be asked of it."""
    if config.kind == "manipulation":
        return True  # a motion that is not as asked is no success, played in physics or not
    return config.execution.until != "off" and config.scene.source == "simulation"


def _logged(log: TrialLog, on_stage: Listener | None) -> Listener:
    """Return a listener that also logs each stage's end, so that a log that is cut shows how far it came."""

    def listen(stage: str, seconds: float) -> None:
        log.message(f"{stage} done", level="debug", stage=stage)
        if on_stage is not None:
            on_stage(stage, seconds)

    return listen


def _unfinished(config: TrialConfig, status: Status, reason: str) -> TrialResult:
    """Return the result of a trial that came to no end: no success where one was to be executed."""
    success = False if _executes(config) else None
    return dataclasses.replace(_started(config), status=status, reason=reason, success=success)


def _reason(error: Exception) -> str:
    if isinstance(error, MemoryError):
        return "memory: the trial needed more than its limit."
    if isinstance(error, InputError | TrialError):
        return str(error)
    return without_places(f"unexpected {type(error).__name__}: {sentence(str(error), _MAX_REASON)}")
