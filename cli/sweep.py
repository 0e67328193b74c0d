"""``graspbench sweep``: a grid of trials."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from graspbench.cli.arguments import ConfigDir, Json, Overrides, Timeout

if TYPE_CHECKING:
    from graspbench.cli.live_page import LivePage
    from graspbench.experiment import ResultStore, SweepOptions, SweepTrial, TrialResult

EXAMPLES = (
    "object=teddy,bottle index.k_cm=0,1 'seed=range(0,5)' --jobs 2 --timeout 300",
    "'object=glob(*)' search.enabled=false --live",
    "experiment=table_3_1 --dry-run",
    "object=teddy 'seed=range(0,500)' engine=slurm engine.jobs=20",
)

_INTERRUPTED = 130


def sweep(
    overrides: Overrides = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="The results folder.")] = Path(
        "results/sweep"
    ),
    jobs: Annotated[
        int | None,
        typer.Option(
            min=0, help="Trials at a time; 0 runs them in this process, for debugging.", show_default="1"
        ),
    ] = None,
    resume: Annotated[bool, typer.Option(help="Skip trials that have a result.")] = True,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Run trials again that failed.")
    ] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop at the first failure.")] = False,
    timeout: Timeout = None,
    memory: Annotated[
        float | None,
        typer.Option(
            min=1, max=100_000_000, help="MB a trial may take beyond its worker's own.", show_default=False
        ),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Write the page as results come; it loads itself again.")
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show the grid, run nothing.")] = False,
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Run a grid of trials, for example: sweep object=teddy,bottle index.k_cm=0,1 'seed=range(0,5)'."""
    from graspbench.cli.live_page import LivePage
    from graspbench.cli.printing import counted, err, print_json, print_rows
    from graspbench.experiment import ResultStore, SweepOptions, load_engine, plan_sweep, split_engine

    ours, grid = split_engine(overrides or [])
    engine = load_engine(ours, config_dir, jobs)
    store = ResultStore(output)
    options = SweepOptions(engine.jobs, resume, retry_failed, fail_fast, timeout, memory, engine)
    trials = plan_sweep(grid, store, options, config_dir)
    rows = [
        {"trial": trial.config.trial_id, "state": trial.state, "overrides": " ".join(trial.overrides)}
        for trial in trials
    ]
    if dry_run:
        print_json(rows) if as_json else print_rows(rows, title=counted(len(rows), "trial"))
        return
    new = sum(trial.state == "new" for trial in trials)
    err.print(f"{counted(len(trials), 'trial')}: {new} to run, {len(trials) - new} there already")
    for warning in dict.fromkeys(trial.config.warning for trial in trials):
        if warning is not None:
            err.print(warning)
    try:
        _run(trials, new, store, options, LivePage(output, len(trials), len(trials) - new) if live else None)
    finally:
        if store.root.is_dir():
            store.write_table()
    found = [store.result(trial.config.trial_id) for trial in trials]
    results = [result for result in found if result is not None]
    if as_json:
        print_json(results)
    else:
        _print_outcome(results, len(trials), output)
    if options.stop.is_set() and not fail_fast:
        raise typer.Exit(_INTERRUPTED)
    if len(results) < len(trials) or any(result.status != "done" for result in results):
        raise typer.Exit(1)


def _run(
    trials: "list[SweepTrial]",
    new: int,
    store: "ResultStore",
    options: "SweepOptions",
    page: "LivePage | None",
) -> None:
    from graspbench.cli.ending import interruptible
    from graspbench.cli.progress import SweepProgress
    from graspbench.experiment import run_sweep

    common = set.intersection(*(set(trial.overrides) for trial in trials)) if len(trials) > 1 else set()
    names = {
        trial.config.trial_id: " ".join(word for word in trial.overrides if word not in common)
        for trial in trials
    }
    with SweepProgress(new, names) as progress, interruptible(options.stop):
        for result in run_sweep(trials, store, options):
            progress.add(result)
            if page is not None:
                page.add()
    if page is not None:
        page.finish()


def _print_outcome(results: "list[TrialResult]", total: int, output: Path) -> None:
    from graspbench.cli.printing import out

    counts: dict[str, int] = {}
    for result in results:
        counts[result.status] = counts.get(result.status, 0) + 1
    if len(results) < total:
        counts["not run"] = total - len(results)
    out.print(", ".join(f"{count} {status}" for status, count in sorted(counts.items())))
    out.print(f"results   {output / 'trials.csv'}")
    out.print(f"next      {shlex.join(['graspbench', 'report', str(output)])}")
