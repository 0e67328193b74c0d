"""``graspbench sweep``: a grid of trials."""

from pathlib import Path
from typing import Annotated

import typer

from graspbench.cli.arguments import ConfigDir, Json, Overrides


def sweep(
    overrides: Overrides = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="The results folder.")] = Path(
        "results/sweep"
    ),
    jobs: Annotated[
        int, typer.Option(min=0, help="Trials at a time; 0 runs them in this process, for debugging.")
    ] = 1,
    resume: Annotated[bool, typer.Option(help="Skip trials that have a result.")] = True,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Run trials again that failed.")
    ] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop at the first failure.")] = False,
    timeout: Annotated[
        float | None, typer.Option(min=0.1, help="Seconds a trial may take.", show_default=False)
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show the grid, run nothing.")] = False,
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Run a grid of trials, for example: sweep object=teddy,bottle index.k_cm=0,1 'seed=range(0,5)'."""
    from graspbench.cli.printing import err, print_json, print_rows
    from graspbench.experiment import ResultStore, SweepOptions, plan_sweep, run_sweep

    store = ResultStore(output)
    options = SweepOptions(jobs, resume, retry_failed, fail_fast, timeout)
    trials = plan_sweep(overrides or [], store, options, config_dir)
    grid = [
        {"trial": trial.config.trial_id, "state": trial.state, "overrides": " ".join(trial.overrides)}
        for trial in trials
    ]
    if dry_run:
        print_json(grid) if as_json else print_rows(grid, title=f"{len(grid)} trials")
        return
    new = sum(trial.state == "new" for trial in trials)
    err.print(f"{len(trials)} trials: {new} to run, {len(trials) - new} there already")
    names = {row["trial"]: row["overrides"] for row in grid}
    try:
        for count, result in enumerate(run_sweep(trials, store, options), 1):
            reason = f": {result['reason']}" if result["reason"] else ""
            err.print(
                f"{count}/{new} {result['trial_id']} {result['status']}{reason}"
                f"  [dim]{names[result['trial_id']]}[/dim]"
            )
    finally:
        if store.root.is_dir():
            store.write_table()
    found = [store.result(trial.config.trial_id) for trial in trials]
    results = [result for result in found if result is not None]
    if as_json:
        print_json(results)
    else:
        _print_outcome(results, output)
    if len(results) < len(trials) or any(result["status"] != "done" for result in results):
        raise typer.Exit(1)


def _print_outcome(results: list[dict[str, object]], output: Path) -> None:
    from graspbench.cli.printing import out

    counts: dict[str, int] = {}
    for result in results:
        counts[str(result["status"])] = counts.get(str(result["status"]), 0) + 1
    out.print(", ".join(f"{count} {status}" for status, count in sorted(counts.items())))
    out.print(f"results   {output / 'trials.csv'}")
    out.print(f"next      graspbench report {output}")
