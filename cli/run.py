"""``graspbench run``: one trial."""

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from graspbench.cli.arguments import ConfigDir, Json, Overrides

Output = Annotated[Path, typer.Option("--output", "-o", help="The results folder.")]


def run(
    overrides: Overrides = None,
    output: Output = Path("results/run"),
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Run one trial: images, reconstruction, local and global planning, execution, record."""
    from graspbench.cli.printing import print_json, print_stage
    from graspbench.experiment import ResultStore, load_config, run_and_store

    config = load_config(overrides or [], config_dir)
    store = ResultStore(output)
    started = time.perf_counter()

    def show_stage(stage: str, seconds: float) -> None:
        print_stage(time.perf_counter() - started, stage, seconds)

    result = run_and_store(config, store, on_stage=show_stage)
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
    else:
        print_rows(
            [_measure_row(result, measure) for measure in result["ratio"]],
            title=f"{result['object']['name']}, {result['hand']['name']} hand, "
            f"{result['hand']['fingers']} fingers, index {result['index']['name']}: local against global",
        )
    out.print(f"results   {folder}")
    for path in sorted(folder.iterdir()):
        if path.suffix in {".png", ".mcap"}:
            out.print(f"{'log' if path.suffix == '.mcap' else 'picture':9s} {path}")


def _measure_row(result: dict[str, Any], measure: str) -> dict[str, Any]:
    best = result["global"][measure]
    return {
        "measure": measure.upper(),
        "local": result["local"][measure],
        "global": best["value"],
        "ratio": result["ratio"][measure],
        "optimal": best["optimal"],
        "local time (ms)": 1e3 * result["local"]["time_s"],
        "global time (ms)": 1e3 * best["time_s"],
    }
