"""``graspbench report``: tables, figures and pages from results folders."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from graspbench.cli.arguments import Json
from graspbench.errors import ConfigurationError

if TYPE_CHECKING:
    import pandas as pd

_TABLES = ("csv", "markdown", "latex")
_FORMATS = (*_TABLES, "parquet", "html")


def report(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Results folders; merged.")],
    formats: Annotated[
        str, typer.Option("--format", help=f"Comma separated: {', '.join(_FORMATS)}.")
    ] = "csv,markdown,latex,html",
    group: Annotated[
        str, typer.Option("--group", help="Also summarise by these columns: object,index.")
    ] = "",
    stat: Annotated[
        str, typer.Option("--stat", help="Of each group: mean, std, ci, median, min, max, count.")
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
    as_json: Json = False,
) -> None:
    """Write tables and a page of one or more results folders: the local-against-global table first."""
    from graspbench.cli.printing import out, print_json

    chosen = _words(formats)
    unknown = [name for name in chosen if name not in _FORMATS]
    if unknown:
        raise ConfigurationError(
            f"unknown report format '{unknown[0]}'", remedy=f"choose from {', '.join(_FORMATS)}"
        )
    target = output or folders[0] / "report"
    if compare:
        text, paths = _compare(folders, chosen, _words(value), target)
    else:
        text, paths = _report(folders, chosen, (_words(group), _words(stat), _words(value)), pictures, target)
    if as_json:
        print_json({"schema": 1, "files": [str(path) for path in paths]})
        return
    out.print(text, markup=False)
    for path in paths:
        out.print(f"written   {path}")


def _report(
    folders: list[Path],
    formats: list[str],
    grouping: tuple[list[str], list[str], list[str]],
    pictures: Literal["auto", "embed", "link", "none"],
    target: Path,
) -> tuple[str, list[Path]]:
    from graspbench.experiment import load_results, results_frame
    from graspbench.report import comparison_table, write_table
    from graspbench.report.groups import correlation_table, frame_markdown, group_table
    from graspbench.report.tables import table_markdown
    from graspbench.results.columns import parquet_bytes
    from graspbench.results.store import write_atomically

    loaded = load_results(folders)
    frame = results_frame(loaded.results, loaded.folders)
    group, stat, value = grouping
    grouped = group_table(frame, group, stat, value) if group else None
    tables = [name for name in formats if name in _TABLES]
    paths = list(write_table(frame, tables, target)) if tables else []
    text = table_markdown(comparison_table(frame))
    if grouped is not None:
        title = f"By {', '.join(group)}"
        paths += _write_frame(grouped, title, "groups", tables, target)
        text += frame_markdown(grouped, title)
    correlations = correlation_table(frame)
    if len(correlations):
        title = "Quality against physics: Spearman's rank correlation with 95 % intervals"
        paths += _write_frame(correlations, title, "correlations", tables, target)
    if "parquet" in formats:
        path = target / "trials.parquet"
        write_atomically(path, parquet_bytes(frame.drop(columns="folder")))
        paths.append(path)
    if "html" in formats:
        from graspbench.report.html import write_page

        places = {
            row["trial_id"]: Path(row["folder"]) for row in frame[["trial_id", "folder"]].to_dict("records")
        }
        title = ", ".join(folder.resolve().name for folder in folders)
        paths.append(write_page(frame, target, places, title=title, pictures=pictures))
    return text, paths


def _compare(
    folders: list[Path], formats: list[str], values: list[str], target: Path
) -> tuple[str, list[Path]]:
    from graspbench.experiment import load_results, results_frame
    from graspbench.report.groups import frame_markdown
    from graspbench.report.paired import compare_experiments

    if len(folders) != 2:
        raise ConfigurationError("--compare takes two folders", remedy="graspbench report --compare A B")
    first, second = (results_frame(load_results([folder]).results) for folder in folders)
    table, keys = compare_experiments(first, second, values)
    title = f"A {folders[0].name} against B {folders[1].name}, paired by {', '.join(keys)}"
    tables = [name for name in formats if name in _TABLES]
    return frame_markdown(table, title), _write_frame(table, title, "compare", tables, target)


def _write_frame(
    table: "pd.DataFrame", title: str, name: str, formats: list[str], target: Path
) -> list[Path]:
    from graspbench.report.groups import frame_latex, frame_markdown
    from graspbench.results.store import write_atomically

    paths = []
    for chosen in formats:
        if chosen == "csv":
            suffix, text = "csv", table.to_csv(index=False, lineterminator="\n")
        elif chosen == "markdown":
            suffix, text = "md", frame_markdown(table, title)
        else:
            suffix, text = "tex", frame_latex(table, title, f"tab:{name}")
        path = target / f"{name}.{suffix}"
        write_atomically(path, text)
        paths.append(path)
    return paths


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]
