"""``graspbench manipulate``: the hand moves the object it grasps."""

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from graspbench.cli.arguments import ConfigDir, Json, Overrides

Output = Annotated[Path, typer.Option("--output", "-o", help="The results folder.")]


def manipulate(
    overrides: Overrides = None,
    output: Output = Path("results/manipulate"),
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Plan a grasp, then move the object in the hand: manipulate object=duck hand=allegro motion=screw."""
    from graspbench.cli.printing import print_json, print_stage
    from graspbench.experiment import ResultStore, load_manipulation_config, manipulate_and_store

    config = load_manipulation_config(overrides or [], config_dir)
    store = ResultStore(output)
    started = time.perf_counter()

    def show_stage(stage: str, seconds: float) -> None:
        print_stage(time.perf_counter() - started, stage, seconds)

    result = manipulate_and_store(config, store, on_stage=show_stage)
    store.write_table()
    if as_json:
        print_json(result)
    else:
        _print_summary(result, store.folder(result["trial_id"]))
    if result["status"] != "done":
        raise typer.Exit(1)


def _print_summary(result: dict[str, Any], folder: Path) -> None:
    from graspbench.cli.printing import out, print_failure, print_rows

    if result["status"] != "done":
        print_failure(result["reason"])
    if "manipulation" in result:
        rows = [{"figure": key, "value": value} for key, value in result["manipulation"].items()]
        print_rows(
            rows,
            title=f"{result['object']['name']}, {result['hand']['name']} hand, motion "
            f"{result['motion']['name']}, {result['contact']} contacts",
        )
    out.print(f"results   {folder}")
    kinds = {".png": "picture", ".mcap": "log", ".csv": "histories"}
    for path in sorted(folder.iterdir()):
        if path.suffix in kinds:
            out.print(f"{kinds[path.suffix]:9s} {path}")
