"""``graspbench report``: tables and figures from results folders."""

from pathlib import Path
from typing import Annotated

import typer

from graspbench.cli.arguments import Json


def report(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Results folders; merged.")],
    formats: Annotated[
        str, typer.Option("--format", help="Comma separated: csv, markdown, latex.")
    ] = "csv,markdown,latex",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Where the files go; DIR/report by default.", show_default=False),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write the local-against-global table of one or more results folders."""
    from graspbench.cli.printing import out, print_json
    from graspbench.experiment import load_results, results_frame
    from graspbench.report import comparison_table, write_table
    from graspbench.report.tables import table_markdown

    chosen = [name.strip() for name in formats.split(",") if name.strip()]
    frame = results_frame(load_results(folders))
    paths = write_table(frame, chosen, output or folders[0] / "report")
    if as_json:
        print_json({"schema": 1, "files": [str(path) for path in paths]})
        return
    out.print(table_markdown(comparison_table(frame)), markup=False)
    for path in paths:
        out.print(f"written   {path}")
