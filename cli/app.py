"""The ``graspbench`` command and how its errors reach the user."""

import importlib
import sys
from typing import Annotated

import typer

from graspbench.cli import (
    bench,
    config,
    hands,
    logs,
    manipulate,
    measures,
    objects,
    paper,
    report,
    run,
    sweep,
    tune,
    view,
)
from graspbench.cli.ending import end_on_signals
from graspbench.errors import GraspbenchError

app = typer.Typer(
    name="graspbench",
    help="Benchmark multi-finger grasps: camera images in; planned, scored, executed, logged grasps out.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)

app.command("run")(run.run)
app.command("sweep")(sweep.sweep)
app.command("tune")(tune.tune)
app.command("report")(report.report)
app.command("view")(view.view)
app.command("paper")(paper.paper)
app.command("manipulate")(manipulate.manipulate)
app.command("config")(config.config)
app.add_typer(objects.app, name="objects")
app.add_typer(hands.app, name="hands")
app.add_typer(measures.app, name="measures")
app.add_typer(logs.app, name="log")
app.command("bench")(bench.bench)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(importlib.import_module("importlib.metadata").version("graspbench"))
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    """Benchmark multi-finger grasps from camera images."""


def main() -> None:
    """Run the command line: errors become one sentence on stderr and an exit code."""
    end_on_signals()
    try:
        app()
    except GraspbenchError as error:
        print(f"graspbench: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    except OSError as error:  # a disk that is full, a folder without rights: the user's to mend
        print(f"graspbench: {_told(error)}.", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("graspbench: interrupted.", file=sys.stderr)
        sys.exit(130)


def _told(error: OSError) -> str:
    """Return what the system says, and of which file."""
    where = f" ({error.filename})" if error.filename else ""
    return f"{error.strerror or error}{where}"
