"""The ``graspbench`` command and how its errors reach the user."""

import contextlib
import io
import os
import sys
from typing import Annotated

import typer

from graspbench.cli import (
    arms,
    bench,
    config,
    evaluate,
    export,
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
from graspbench.cli.completion import use_own_scripts
from graspbench.cli.foreign import refuse_hydras_options
from graspbench.cli.help import epilog, use_plain_flags
from graspbench.errors import GraspbenchError, OutputError

use_own_scripts()
use_plain_flags()
app = typer.Typer(
    name="graspbench",
    help="Benchmark multi-finger grasps: camera images in; planned, scored, executed, logged grasps out.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

app.command("run", epilog=epilog("run", run.EXAMPLES))(run.run)
app.command("sweep", epilog=epilog("sweep", sweep.EXAMPLES))(sweep.sweep)
app.command("tune")(tune.tune)
app.command("report")(report.report)
app.command("view")(view.view)
app.command("paper")(paper.paper)
app.command("evaluate")(evaluate.evaluate)
app.command("export")(export.export)
app.command("manipulate", epilog=epilog("manipulate", manipulate.EXAMPLES))(manipulate.manipulate)
app.command("config")(config.config)
app.add_typer(objects.app, name="objects")
app.add_typer(hands.app, name="hands")
app.add_typer(arms.app, name="arms")
app.add_typer(measures.app, name="measures")
app.add_typer(logs.app, name="log")
app.command("bench")(bench.bench)


def _print_version(wanted: bool) -> None:
    if wanted:
        from graspbench.results.provenance import described_version

        typer.echo(described_version())
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print version and commit."),
    ] = False,
) -> None:
    """Benchmark multi-finger grasps from camera images."""


def main() -> None:
    """Run the command line: errors become one sentence on stderr and an exit code."""
    printable = _open_streams()
    try:
        if not printable:
            raise OutputError("the standard output is closed", remedy="send it to a file, or to /dev/null")
        try:
            refuse_hydras_options(sys.argv[1:])
            app()
        finally:
            _flush()
    except GraspbenchError as error:
        print(f"graspbench: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    except UnicodeError as error:  # a name that no file can have
        print(f"graspbench: a text cannot be used ({error}).", file=sys.stderr)
        sys.exit(2)
    except OSError as error:  # a disk that is full, a folder without rights: the user's to mend
        print(f"graspbench: {_told(error)}.", file=sys.stderr)
        sys.exit(2)


def _open_streams() -> bool:
    """Make sure that the standard streams are there, and that they take any character.

    A closed one would give its number to the next file that is opened, which would then be printed into.

    Returns:
        Whether the standard output was open: what is printed would be lost otherwise.
    """
    printable = True
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            printable = printable and name != "stdout"
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
            if getattr(sys, name) is None:
                setattr(sys, name, open(number, "r" if number == 0 else "w", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    return printable


def _flush() -> None:
    """Write what is still to be printed now, while a failure can be told."""
    try:
        sys.stdout.flush()
    except OSError:
        # Nothing more of it can be written: the interpreter must not try again as it ends.
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        raise


def _told(error: OSError) -> str:
    """Return what the system says, and of which file."""
    where = f" ({error.filename})" if error.filename else ""
    return f"{error.strerror or error}{where}"
