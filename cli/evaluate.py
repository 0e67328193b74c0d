"""``graspbench evaluate``: grasps planned anywhere, judged alike."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from graspbench.cli.arguments import ConfigDir, Json, complete_object

if TYPE_CHECKING:
    from graspbench.experiment import Evaluation

_FEW = 20


def evaluate(
    grasps: Annotated[
        Path,
        typer.Argument(
            help="A file of grasps, or a folder of such files; without --object: a results folder, whose "
            "planners are compared."
        ),
    ],
    overrides: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[OVERRIDES]...",
            help="protocol=six_forces,resist (or all, none), protocol.mass_kg=0.2, object.scale=0.1, "
            "quality.friction=0.6, hand.fingers=3 and the like.",
            show_default=False,
        ),
    ] = None,
    hand: Annotated[str, typer.Option("--hand", "-H", help="An option of the group 'hand'.")] = "allegro",
    object_name: Annotated[
        str,
        typer.Option(
            "--object",
            "-O",
            help="A catalogue object, or a mesh file.",
            autocompletion=complete_object,
            show_default=False,
        ),
    ] = "",
    file_format: Annotated[
        str | None,
        typer.Option(
            "--format",
            help="jsonl, parquet, isaac, dexgraspbench or dexgraspnet; found out by default.",
            show_default=False,
        ),
    ] = None,
    read_as: Annotated[
        str | None,
        typer.Option(
            help="What the file's writer meant instead: xyzw, degrees, millimetres, several with commas.",
            show_default=False,
        ),
    ] = None,
    as_it_is: Annotated[
        bool, typer.Option("--as-it-is", help="Take the file as it is, even where it seems to be wrong.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Source of every random draw.")] = 0,
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=0, help="Processes; 0: in this one.")] = 0,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Folder for evaluation.json, grasps.csv and planners.csv.",
            show_default=False,
        ),
    ] = None,
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Judge grasps of any planner: close the real hand, measure, and try them in physics by protocols."""
    from graspbench.errors import ConfigurationError
    from graspbench.experiment.evaluation_start import start_evaluation_workers

    if not object_name and not grasps.exists():
        raise ConfigurationError(f"there is no file or results folder {grasps}", remedy="correct its path")
    if not object_name and not grasps.is_dir():
        raise ConfigurationError("no object is given", remedy="say --object NAME, or --object FILE of a mesh")
    if jobs:
        start_evaluation_workers()
    from graspbench.cli.printing import print_json  # only now, since these take long to load
    from graspbench.cli.ticker import Saying
    from graspbench.experiment import EvaluateOptions, evaluate_file, evaluate_results

    options = EvaluateOptions(
        hand=hand,
        object=object_name,
        overrides=overrides or [],
        config_dir=config_dir,
        format=file_format,
        read_as=read_as.split(",") if read_as else (),
        as_it_is=as_it_is,
        seed=seed,
        jobs=jobs,
    )

    with Saying(f"reading {grasps}") as saying:

        def tell(done: int, of: int) -> None:
            saying.now("judging", f"{done} of {of} grasps done")

        if object_name:
            evaluation = evaluate_file(grasps, options, tell)
        else:
            evaluation = evaluate_results(grasps, options, output, tell)
    if output is not None:
        _store(evaluation, output)
    if as_json:
        print_json(evaluation.as_tree())
    else:
        _print(evaluation)


def _print(evaluation: "Evaluation") -> None:
    from graspbench.cli.printing import counted, out, print_rows

    about = evaluation.about
    title = (
        f"{counted(about['count'], 'grasp')} of {about['grasps']}: {about['hand']} hand, {about['object']}"
    )
    rows: list[dict[str, Any]] = [
        {
            "protocol": row["protocol"],
            "success": row["success"],
            "from": row["low"],
            "to": row["high"],
            "grasps": row["grasps"],
            "mean value": row.get("value"),
            "value from": row.get("value_low"),
            "value to": row.get("value_high"),
            "unit": row.get("unit", ""),
        }
        for row in evaluation.protocols
    ]
    print_rows(rows, title=f"{title}; 95 % intervals")
    if evaluation.planners:
        print_rows(evaluation.planners, title="Planners: trials, grasps found, and share of successes")
    if evaluation.ranks:
        columns = ("first", "second", "tau", "p", "inversions", "pairs", "grasps")
        print_rows(evaluation.ranks, title="How protocols agree on ranks (Kendall's tau-b)", columns=columns)
    for row in evaluation.rows:
        lost = {name: each["reason"] for name, each in row["protocols"].items() if each["reason"]}
        faults = [*row["violations"], *(f"{name}: {reason}" for name, reason in lost.items())]
        if row["reason"] or (faults and about["count"] <= _FEW):
            out.print(f"grasp {row['grasp']}: {row['reason'] or '; '.join(faults)}", highlight=False)


def _store(evaluation: "Evaluation", folder: Path) -> None:
    import pandas as pd

    from graspbench.experiment import to_json
    from graspbench.results.store import write_atomically
    from graspbench.results.table_files import csv_text

    write_atomically(folder / "evaluation.json", to_json(evaluation.as_tree()))
    grasps = pd.json_normalize(evaluation.rows)
    rows = [dict(zip(map(str, grasps), row, strict=True)) for row in grasps.itertuples(index=False)]
    write_atomically(folder / "grasps.csv", csv_text([str(name) for name in grasps], rows))
    if evaluation.planners:
        columns = list(dict.fromkeys(name for row in evaluation.planners for name in row))
        write_atomically(folder / "planners.csv", csv_text(columns, evaluation.planners))
