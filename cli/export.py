"""``graspbench export``: planned grasps written for other benchmarks."""

from pathlib import Path
from typing import Annotated

import typer

from graspbench.cli.arguments import Json


def export(
    results: Annotated[list[Path], typer.Argument(help="Results folders of run or sweep.")],
    file_format: Annotated[
        str, typer.Option("--format", help="jsonl, parquet, isaac, dexgraspbench or dexgraspnet.")
    ] = "jsonl",
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="File, or folder where there are several hands or objects; default: grasps.SUFFIX.",
            show_default=False,
        ),
    ] = None,
    which: Annotated[
        str, typer.Option(help="Grasps of a trial: local, restarted, global, refined or all.")
    ] = "local",
    as_json: Json = False,
) -> None:
    """Write the grasps of trials for other benchmarks, and for evaluate."""
    from graspbench.cli.printing import print_json, print_rows
    from graspbench.cli.ticker import Saying
    from graspbench.evaluation.formats.format import FORMATS
    from graspbench.experiment import export_results

    target = output or Path("grasps" + FORMATS[file_format].suffixes[0])
    with Saying("reading and writing the grasps"):
        rows = export_results(results, file_format, target, which)
    if as_json:
        print_json({"schema": 1, "rows": rows})
    else:
        print_rows(rows)
