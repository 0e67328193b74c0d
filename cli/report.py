"""``graspbench report``: tables, figures and pages from results folders."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from graspbench.cli.arguments import Json, complete_list
from graspbench.cli.option_values import STATISTICS
from graspbench.errors import ConfigurationError

if TYPE_CHECKING:
    from graspbench.report import Table

_TABLES = ("csv", "markdown", "latex")
_FORMATS = (*_TABLES, "parquet", "html")


def report(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Results folders; merged.")],
    formats: Annotated[
        str,
        typer.Option(
            "--format",
            help=f"Comma separated: {', '.join(_FORMATS)}.",
            autocompletion=complete_list(_FORMATS),
        ),
    ] = "csv,markdown,latex,html",
    group: Annotated[
        str, typer.Option("--group", help="Also summarise by these columns: object,index.")
    ] = "",
    stat: Annotated[
        str,
        typer.Option(
            "--stat",
            help=f"Of each group: {', '.join(STATISTICS)}.",
            autocompletion=complete_list(STATISTICS),
        ),
    ] = "mean,ci",
    value: Annotated[
        str, typer.Option("--value", help="Columns to summarise or compare.", show_default="ratios and time")
    ] = "",
    compare: Annotated[
        bool, typer.Option("--compare", help="Compare two folders A B trial by trial instead.")
    ] = False,
    pictures: Annotated[
        Literal["auto", "embed", "link", "none"],
        typer.Option(help="Pictures in the page: carried in it, linked to, or none; auto embeds a few."),
    ] = "auto",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Where the files go; DIR/report by default.", show_default=False),
    ] = None,
    mlflow: Annotated[
        Path | None,
        typer.Option(
            help="Also write the trials as runs of MLflow, to a database in this folder.",
            show_default=False,
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write tables and a page of results folders: a leaderboard of planners, local against global."""
    from graspbench.cli.printing import out, print_json, print_table
    from graspbench.cli.ticker import Saying
    from graspbench.report.statistics import check_statistics
    from graspbench.report.tables import to_json_rows

    chosen = _words(formats)
    unknown = [name for name in chosen if name not in _FORMATS]
    if unknown:
        raise ConfigurationError(
            f"unknown report format '{unknown[0]}'", remedy=f"choose from {', '.join(_FORMATS)}"
        )
    check_statistics(_words(stat))
    if compare and mlflow is not None:
        raise ConfigurationError(
            "--mlflow with --compare", remedy="export each folder by a report of its own"
        )
    target = output or folders[0] / "report"
    with Saying("reading the results") as saying:
        if compare:
            tables, paths = _compare(folders, chosen, _words(value), target)
        else:
            grouping = _words(group), _words(stat), _words(value)
            tables, paths = _report(folders, chosen, grouping, pictures, target, mlflow, saying.now)
    if as_json:
        contents = {table.name: to_json_rows(table) for table in tables}
        print_json({"schema": 1, "files": [str(path) for path in paths], "tables": contents})
        return
    for table in tables:
        print_table(table)
    for path in paths:
        out.print(f"written   {path}")


def _report(
    folders: list[Path],
    formats: list[str],
    grouping: tuple[list[str], list[str], list[str]],
    pictures: Literal["auto", "embed", "link", "none"],
    target: Path,
    mlflow: Path | None,
    tell: Callable[[str], None],
) -> tuple[list["Table"], list[Path]]:
    from graspbench.cli.printing import counted
    from graspbench.experiment import load_results, results_frame
    from graspbench.report import comparison_table, write_tables
    from graspbench.report.correlations import correlation_table
    from graspbench.report.groups import group_table
    from graspbench.report.planners import planner_tables
    from graspbench.results.columns import is_switch, trial_rows
    from graspbench.results.store import write_atomically
    from graspbench.results.table_files import parquet_bytes

    loaded = load_results(folders)
    frame = results_frame(loaded.results, loaded.folders)
    tell(f"making tables of {counted(len(frame), 'trial')}")
    group, stat, value = grouping
    shown = [*planner_tables(frame), comparison_table(frame)]
    if group:
        shown.append(group_table(frame, group, stat, value))
    correlations = correlation_table(frame)
    if correlations.rows:
        shown.append(correlations)
    paths = list(write_tables(shown, target, [name for name in formats if name in _TABLES]))
    if "parquet" in formats:
        path, table = target / "trials.parquet", trial_rows(loaded.results)
        write_atomically(path, parquet_bytes(table.columns, table.rows, is_switch))
        paths.append(path)
    if "html" in formats:
        from graspbench.report.results_page import write_loaded_page

        tell(f"writing the page of {counted(len(frame), 'trial')}")
        paths.append(write_loaded_page(folders, loaded, frame, target, shown, pictures))
    if mlflow is not None:
        from graspbench.report.mlflow_export import export_to_mlflow

        tell(f"writing {counted(len(frame), 'trial')} as runs of MLflow")
        name = ", ".join(folder.resolve().name for folder in folders)
        database, _ = export_to_mlflow(frame, loaded, mlflow, name)
        paths.append(database)
    return shown, paths


def _compare(
    folders: list[Path], formats: list[str], values: list[str], target: Path
) -> tuple[list["Table"], list[Path]]:
    from graspbench.experiment import load_results, results_frame
    from graspbench.report import write_tables
    from graspbench.report.paired import compare_experiments

    if len(folders) != 2:
        raise ConfigurationError("--compare takes two folders", remedy="graspbench report --compare A B")
    first, second = (results_frame(load_results([folder]).results) for folder in folders)
    names = (folders[0].resolve().name, folders[1].resolve().name)
    table = compare_experiments(first, second, values, names)
    return [table], list(write_tables([table], target, [name for name in formats if name in _TABLES]))


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]
