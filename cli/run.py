"""``graspbench run``: one trial."""

import csv
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from graspbench.beside import Beside
from graspbench.cli.arguments import ConfigDir, Json, Overrides
from graspbench.trial.drawer import drawer

if TYPE_CHECKING:
    from graspbench.experiment import TrialConfig, TrialResult

EXAMPLES = (
    "object=bottle hand.fingers=4",
    "object=duck hand=allegro --video",
    "object.mesh=cup.stl object.scale=0.001",
    "index=quality_ascent search.enabled=false",
    "--config results/run/TRIAL",
)

Output = Annotated[Path, typer.Option("--output", "-o", help="The results folder.")]


def run(
    overrides: Overrides = None,
    output: Output = Path("results/run"),
    as_json: Json = False,
    config_dir: ConfigDir = None,
    stored: Annotated[
        Path | None,
        typer.Option(
            "--config",
            help="Repeat a stored trial: its folder or its config.yaml; overrides change single values.",
            show_default=False,
        ),
    ] = None,
    video: Annotated[bool, typer.Option("--video", help="Film the execution: record.video=true.")] = False,
) -> None:
    """Run one trial: images, reconstruction, local and global planning, execution, record."""
    with drawer(beside=True) as beside:  # it loads while this process loads other things
        from graspbench.experiment import load_one_config, load_stored_config

        given = [*(overrides or []), *(["record.video=true"] if video else [])]
        config = load_one_config(given, config_dir) if stored is None else load_stored_config(stored, given)
        run_and_show(config, output, as_json, beside)


def run_and_show(config: "TrialConfig", output: Path, as_json: bool, beside: Beside | None = None) -> None:
    """Run a trial of any kind, tell its stages and its result; exit code 1 when it is not done."""
    from graspbench.cli.printing import err, print_json, print_stage
    from graspbench.cli.stages import stage_activity
    from graspbench.cli.ticker import Ticker
    from graspbench.experiment import ResultStore, Watch, run_and_store

    store = ResultStore(output)
    if config.warning is not None:
        err.print(config.warning)
    watch = Watch()

    def show_stage(stage: str, seconds: float) -> None:
        print_stage(time.perf_counter() - ticker.started, stage, seconds)

    with Ticker(partial(stage_activity, watch)) as ticker:
        result = run_and_store(config, store, on_stage=show_stage, watch=watch, beside=beside)
    store.write_table()
    if as_json:
        print_json(result)
    else:
        _print_summary(result, store.folder(result.trial_id))
    if result.status != "done":
        raise typer.Exit(1)


def _print_summary(result: "TrialResult", folder: Path) -> None:
    from graspbench.cli.printing import out, print_failure, print_rows
    from graspbench.cli.verdict import verdict
    from graspbench.grasp.quality import THESIS_MEASURES

    if result.status != "done":
        print_failure(result.reason)
    else:
        out.print(verdict(result))
    who = f"{result.object.name}, {result.hand.name} hand, {result.hand.fingers} fingers"
    if result.manipulation is not None:
        figures = [{"figure": key, "value": value} for key, value in vars(result.manipulation).items()]
        motion, contact = result.config["motion"]["name"], result.config["contact"]["kind"]
        print_rows(figures, title=f"{who}, motion {motion}, {contact} contacts")
    elif result.local is not None:
        searched = result.global_
        rows = [_measure_row(result, measure) for measure in searched or THESIS_MEASURES]
        told = "local against global" if searched else "the local grasp"
        print_rows(rows, title=f"{who}, index {result.index['name']}: {told}")
    if (folder / "range.csv").exists():
        with (folder / "range.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        print_rows(rows, title=f"{who}: how far the object can be moved (m) and turned (deg), palm axes")
    out.print(f"results   {folder}")
    for path in sorted(folder.iterdir()):
        if path.suffix in _SHOWN_FILES:
            out.print(f"{_SHOWN_FILES[path.suffix]:9s} {path}")


_SHOWN_FILES = {".png": "picture", ".mp4": "film", ".gif": "film", ".mcap": "log", ".csv": "histories"}


def _measure_row(result: "TrialResult", measure: str) -> dict[str, Any]:
    local, best = result.local, result.global_.get(measure)
    assert local is not None, "a trial that is done has a grasp"
    row = {"measure": measure.upper(), "local": getattr(local, measure, None)}
    if best is not None:
        row |= {
            "global": best.value if best.contacts else None,
            "ratio": result.ratio.get(measure),
            "optimal": best.optimal,
        }
    row |= {"local time (ms)": 1e3 * local.time_s}
    return row if best is None else row | {"global time (ms)": 1e3 * best.time_s}
