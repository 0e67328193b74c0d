"""The thesis' experiments, by name."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graspbench.experiment.store import ResultStore, results_frame
from graspbench.experiment.sweep import SweepOptions, plan_sweep, run_sweep
from graspbench.report import comparison_table, write_table

Say = Callable[[str], None]


@dataclass(frozen=True)
class PaperResult:
    """What an experiment gives.

    Attributes:
        rows: The rows of its table.
        document: The machine-readable document.
        files: Tables and pictures that were written.
    """

    rows: Sequence[dict[str, Any]]
    document: dict[str, Any]
    files: Sequence[Path]


Experiment = Callable[[Path, Sequence[str], int, Path | None, Say], PaperResult]

# The thesis' two objects first, each with its number of fingers; then the others it names.
TABLE_3_1_OBJECTS = {"bottle": 4, "teddy": 3, "cylinder": 3, "egg": 3, "glass": 3, "duck": 3}


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


EXPERIMENTS: dict[str, Experiment] = {"table-3.1": table_3_1}
