"""``graspbench tune``: search for the values of numeric options that make a measure best."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from graspbench.cli.arguments import ConfigDir, Json, Overrides, Timeout

if TYPE_CHECKING:
    from graspbench.sweep.tune import Axis


def tune(
    overrides: Overrides = None,
    measure: Annotated[
        str, typer.Option("--measure", "-m", help="Column of trials.csv whose mean is to be best.")
    ] = "success",
    direction: Annotated[
        Literal["maximize", "minimize"], typer.Option(help="Whether more or less is better.")
    ] = "maximize",
    candidates: Annotated[
        int, typer.Option("--candidates", "-n", min=1, max=100_000, help="Value sets to try in all.")
    ] = 20,
    failed: Annotated[
        float | None,
        typer.Option(
            min=-1e15,
            max=1e15,
            help="What a trial without the measure counts.",
            show_default="gives the set up",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=4_000_000_000, help="Of the search.")] = 0,
    jobs: Annotated[int | None, typer.Option(min=0, help="Trials at a time.", show_default="1")] = None,
    timeout: Timeout = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="The results folder.")] = Path(
        "results/tune"
    ),
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Search options given as intervals: tune 'index.k_e=interval(0.1,10)' object=teddy,duck -m ratio.q1."""
    from graspbench.cli.ending import interruptible
    from graspbench.cli.printing import out, print_json, print_rows
    from graspbench.cli.ticker import Saying
    from graspbench.experiment import ResultStore, SweepOptions, load_engine, split_engine
    from graspbench.sweep.tune import TuneOptions, run_tuning, split_axes

    ours, rest = split_engine(overrides or [])
    engine = load_engine(ours, config_dir, jobs)
    axes, grid = split_axes(rest)
    store = ResultStore(output)
    sweep = SweepOptions(engine.jobs, timeout_s=timeout, engine=engine)
    options = TuneOptions(measure, direction, candidates, failed, seed)

    def show(candidate: dict[str, Any]) -> None:
        words = [
            f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}"
            for key, value in candidate.items()
        ]
        saying.say("  ".join(words))

    saying = Saying("the first candidate")
    try:
        with interruptible(sweep.stop), saying:
            study = run_tuning(axes, grid, store, options, sweep, config_dir, show)
    finally:
        if any(store.root.glob("[!.]*/result.json")):
            store.write_table()
    rows = [
        {"candidate": found.number, measure: found.value, **found.params}
        for found in sorted(study.trials, key=lambda found: found.number)
        if found.value is not None
    ]
    ranked = sorted(rows, key=lambda row: row[measure], reverse=direction == "maximize")
    best = _command(axes, grid, ranked[0], config_dir) if ranked else None
    if as_json:
        document = {"schema": 1, "measure": measure, "direction": direction, "rows": ranked, "best": best}
        print_json(document)
    else:
        print_rows(ranked[:10], title=f"best by {measure}")
        out.print(f"results   {output / 'trials.csv'}")
        if best is not None:
            out.print(f"best      {best}", markup=False)
    if not ranked:
        raise typer.Exit(1)


def _command(
    axes: "Sequence[Axis]", grid: "Sequence[str]", best: "Mapping[str, Any]", config_dir: Path | None
) -> str:
    """Return the command that runs the best candidate's trials again, quoted for a shell."""
    from graspbench.experiment import expand_sweep
    from graspbench.sweep.tune import axis_overrides

    overrides = [*grid, *axis_overrides(axes, best)]
    command = "run" if len(expand_sweep(overrides, config_dir)) == 1 else "sweep"
    place = [] if config_dir is None else ["--config-dir", str(config_dir)]
    return shlex.join(["graspbench", command, *overrides, *place])
