"""Does the planned grasp hold? Success rates in physics, and what the quality measures foretell of them."""

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from graspbench.config.groups import group_options
from graspbench.paper.paper_result import PaperResult, Say, published
from graspbench.results.columns import results_frame
from graspbench.results.plain import to_json
from graspbench.results.store import SCHEMA_VERSION, ResultStore, write_atomically
from graspbench.results.trial_result import TrialResult
from graspbench.sweep.grid import SweepOptions, plan_sweep, run_sweep

# Grip forces in proportion to the weight make pushes in weights comparable between objects.
_DEFAULTS = (
    "search.enabled=false",
    "record=off",
    "scene.yaw_deg=null",
    "execution=pushes",
    "execution.grip_force_n=0.5",
)
_SEEDS = "seed=range(0,5)"
_FAMILIES = ("folder", "mesh", "random", "ycb")
_OUTCOMES = ("success", "execution.largest_push_weight")
_TITLE = "Planned grasps in physics: lift, hold and wrist rotation"

Rows = list[dict[str, Any]]


def physical(
    output: Path, overrides: Sequence[str], jobs: int, config_dir: Path | None, say: Say
) -> PaperResult:
    """Execute planned grasps on every object of the catalogue; tell who held, and what it withstood.

    Trials that are in the folder already are not run again.

    Args:
        output: Folder of the trials and tables.
        overrides: Options of the trials; an object or a seed among them takes the place of the catalogue and
            of the five seeds.
        jobs: Trials at a time.
        config_dir: A user's folder of options.
        say: Told about the progress.

    Raises:
        ConfigurationError: An option cannot be used; nothing is run then.
    """
    store, options = ResultStore(output), SweepOptions(jobs=jobs)
    trials = plan_sweep(_grid(overrides, config_dir), store, options, config_dir)
    for count, result in enumerate(run_sweep(trials, store, options), 1):
        say(f"{count}/{len(trials)} {result.trial_id} {result.object.name} {result.status}")
    store.write_table()
    found = [store.result(trial.config.trial_id) for trial in trials]
    results = [result for result in found if result is not None]
    rows = success_rows(results)
    with published(output) as folder:
        document = _write(rows, results, folder)
        names = sorted(path.name for path in folder.iterdir())
    shown = [{key: value for key, value in row.items() if key != "reasons"} for row in rows]
    return PaperResult(shown, document, [output / name for name in names])


def success_rows(results: Sequence[TrialResult]) -> Rows:
    """Count, for each object and for all, the planned grasps that held, with Wilson's interval.

    A trial counts as planned when the local planner found a grasp and the hand could reach it.

    Args:
        results: Results of executed trials.
    """
    groups: dict[str, list[TrialResult]] = {}
    for result in results:
        groups.setdefault(result.object.name, []).append(result)
    return [_row(name, group) for name, group in [*sorted(groups.items()), ("all", list(results))]]


def _row(name: str, results: Sequence[TrialResult]) -> dict[str, Any]:
    from graspbench.report.statistics import wilson_interval  # loads pandas

    executed = [result.execution for result in results if result.execution is not None]
    rate = wilson_interval(sum(execution.success for execution in executed), len(executed))
    pushes = [x.largest_push_weight for x in executed if x.largest_push_weight is not None]
    failed = [str(execution.reason) for execution in executed if not execution.success]
    unplanned = [str(result.reason) for result in results if result.execution is None]
    return {
        "object": name,
        "trials": len(results),
        "planned": len(executed),
        "held": len(executed) - len(failed),
        "rate": rate.value,
        "low": rate.low,
        "high": rate.high,
        "push_weight": median(pushes) if pushes else None,
        "reasons": "; ".join(sorted({*failed, *unplanned})),
    }


def _grid(overrides: Sequence[str], config_dir: Path | None) -> list[str]:
    """Return the sweep's overrides: the catalogue and five seeds, unless others are asked for."""
    grid = list(_DEFAULTS)
    if not any(override.startswith("object") for override in overrides):
        names = [name for name in group_options(config_dir)["object"] if name not in _FAMILIES]
        grid.append("object=" + ",".join(names))
    if not any(override.startswith("seed=") for override in overrides):
        grid.append(_SEEDS)
    return [*grid, *overrides]


def _write(rows: Rows, results: Sequence[TrialResult], folder: Path) -> dict[str, Any]:
    from graspbench.report.correlations import correlation_table  # loads pandas
    from graspbench.report.tables import Column, Table, write_tables

    columns = (
        Column("object", "object"),
        Column("planned", "planned", format="d"),
        Column("held", "held", format="d"),
        Column("rate", "rate", format=".2f", interval=("low", "high")),
        Column("push_weight", "push", "weights", ".1f"),
        Column("reasons", "why not"),
    )
    notes = (
        "Planned: the local planner found a grasp that the hand reaches. Held: all fingers touched, and the "
        "object was in the hand after lift, hold and rotation; rate with Wilson's 95 % interval. Push: "
        "median of the weakest of six directions.",
    )
    correlations = correlation_table(results_frame(results), outcomes=_OUTCOMES)
    write_tables([Table("table", _TITLE, columns, tuple(rows), notes), correlations], folder)
    document = {"rows": rows, "correlations": list(correlations.records)}
    write_atomically(folder / "result.json", to_json({"schema": SCHEMA_VERSION, **document}))
    return document
