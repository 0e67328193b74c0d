"""The thesis' experiments, by name."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from graspbench.errors import ConfigurationError
from graspbench.experiment.appendix_a import appendix_a
from graspbench.experiment.figures_3 import figures_3
from graspbench.experiment.paper_result import PaperResult, Say
from graspbench.experiment.store import (
    SCHEMA_VERSION,
    ResultStore,
    results_frame,
    to_json,
    write_atomically,
)
from graspbench.experiment.sweep import SweepOptions, plan_sweep, run_sweep
from graspbench.report import comparison_table, write_table

Experiment = Callable[[Path, Sequence[str], int, Path | None, Say], PaperResult]

# The thesis' two objects first, each with its number of fingers; then the others it names.
TABLE_3_1_OBJECTS = {"bottle": 4, "teddy": 3, "cylinder": 3, "easter_egg": 3, "glass": 3, "duck": 3}


def table_3_1(
    output: Path, overrides: Sequence[str], jobs: int, config_dir: Path | None, say: Say
) -> PaperResult:
    """Local against global for every object, with and without the pull to the centroid (table 3.1)."""
    store, options = ResultStore(output), SweepOptions(jobs=jobs)
    trials = []
    for name, fingers in TABLE_3_1_OBJECTS.items():
        cell = [f"object={name}", f"hand.fingers={fingers}", "index.k_cm=1,0", *overrides]
        trials += plan_sweep(cell, store, options, config_dir)
    for count, result in enumerate(run_sweep(trials, store, options), 1):
        say(f"{count} {result['trial_id']} {result['object']['name']} {result['status']}")
    store.write_table()
    frame = results_frame([found for trial in trials if (found := store.result(trial.config.trial_id))])
    rows = [_table_row(row) for row in comparison_table(frame)]
    files = write_table(frame, ("csv", "markdown", "latex"), output / "report")
    return PaperResult(rows, {"rows": rows}, files)


def _table_row(row: Any) -> dict[str, Any]:
    cells: dict[str, Any] = {"object": row.object, "k_cm": row.k_cm, "fingers": row.fingers}
    for i, cell in enumerate(row.cells, 1):
        cells[f"ratio_q{i}"], cells[f"thesis_q{i}"] = cell.ratio, cell.thesis
    return cells


def case_study(
    output: Path, overrides: Sequence[str], jobs: int, config_dir: Path | None, say: Say
) -> PaperResult:
    """Two planar grippers move a bar, with and without secondary tasks (section 4.5, figures 4.4 to 4.7)."""
    from graspbench.manipulation import run_case_study
    from graspbench.report.case_study_figures import draw_case_study, write_histories

    if overrides:
        raise ConfigurationError(
            "the case study takes no overrides", remedy="use graspbench.manipulation.run_case_study"
        )
    results = {}
    for with_tasks in (True, False):
        name = "with_tasks" if with_tasks else "without_tasks"
        say(f"simulating the case study {name.replace('_', ' ')}")
        results[name] = run_case_study(with_tasks)
    output.mkdir(parents=True, exist_ok=True)
    say("drawing")
    files = list(draw_case_study(list(results.values()), output))
    files.append(write_histories(list(results.values()), output / "histories.csv"))
    document = {name: result.summary() for name, result in results.items()}
    write_atomically(output / "result.json", to_json({"schema": SCHEMA_VERSION, **document}))
    rows = [{"case": name.replace("_", " "), **_shown(found)} for name, found in document.items()]
    return PaperResult(rows, document, [*files, output / "result.json"])


def _shown(summary: dict[str, Any]) -> dict[str, Any]:
    keys = (
        "pose_error_max_m",
        "q3_max_rad",
        "distance_13_min_m",
        "midpoint_distance_after_first_pause_max_m",
        "closed_chain_residual_max_m",
    )
    return {key: summary[key] for key in keys}


EXPERIMENTS: dict[str, Experiment] = {
    "table-3.1": table_3_1,
    "figures-3": figures_3,
    "appendix-a": appendix_a,
    "case-study": case_study,
}
