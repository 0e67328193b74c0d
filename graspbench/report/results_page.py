"""The page of results folders, with the tables that stand first on it."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from graspbench.report.columns import FOLDER, TRIAL_ID
from graspbench.report.comparison import comparison_table
from graspbench.report.correlations import correlation_table
from graspbench.report.html import Pictures, write_page
from graspbench.report.planners import planner_tables
from graspbench.report.tables import Table
from graspbench.results.columns import results_frame
from graspbench.results.store import LoadedResults, load_results


def write_results_page(
    folders: Sequence[Path], output_dir: Path, running: str | None = None, pictures: Pictures = "auto"
) -> Path:
    """Read results folders and write their page.

    Args:
        folders: Results folders; merged.
        output_dir: Where ``index.html`` goes; made if need be.
        running: See `graspbench.report.html.write_page`.
        pictures: See there.

    Raises:
        LogError: A folder does not exist or holds no trial.
    """
    loaded = load_results(list(folders))
    trials = results_frame(loaded.results, loaded.folders)
    correlations = correlation_table(trials)
    tables = [
        *planner_tables(trials),
        comparison_table(trials),
        *([correlations] if correlations.rows else []),
    ]
    return write_loaded_page(folders, loaded, trials, output_dir, tables, pictures, running)


def write_loaded_page(
    folders: Sequence[Path],
    loaded: LoadedResults,
    trials: pd.DataFrame,
    output_dir: Path,
    tables: Sequence[Table],
    pictures: Pictures = "auto",
    running: str | None = None,
) -> Path:
    """Write the page of results that were read already.

    Args:
        folders: Where they are from.
        loaded: What was read.
        trials: The same as a table.
        output_dir: Where ``index.html`` goes; made if need be.
        tables: What stands first on it.
        pictures: See `graspbench.report.html.write_page`.
        running: See there.
    """
    places = {trial_id: Path(folder) for trial_id, folder in loaded.folders.items()}
    title = ", ".join(folder.resolve().name for folder in folders)
    if FOLDER in trials:
        shown = {trial_id: _below(folders, Path(place)) for trial_id, place in loaded.folders.items()}
        trials = trials.copy()
        trials[FOLDER] = [shown.get(str(each)) for each in trials[TRIAL_ID]]
    return write_page(
        trials, output_dir, places, title=title, pictures=pictures, tables=tables, running=running
    )


def _below(folders: Sequence[Path], place: Path) -> str:
    """Return where a trial is, from its results folder's name on: where that lies is nobody's business."""
    for folder in folders:
        if place.is_relative_to(folder):
            return (Path(folder.resolve().name) / place.relative_to(folder)).as_posix()
    return place.name
