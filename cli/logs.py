"""``graspbench log``: look into a trial's log, or save one that was cut off."""

from pathlib import Path
from typing import Annotated

import typer

from graspbench.cli.arguments import Json

app = typer.Typer(help="Look into a trial's log, or save one that was cut off.", no_args_is_help=True)

LogFile = Annotated[Path, typer.Argument(metavar="FILE", help="A trial.mcap or trial.mcap.partial.")]


@app.command("info")
def info(path: LogFile, as_json: Json = False) -> None:
    """Print a log's channels, message counts, duration, metadata and attachments."""
    import dataclasses

    from graspbench.cli.printing import out, print_json, print_rows
    from graspbench.record import log_info

    found = log_info(path)
    if as_json:
        print_json({"schema": 1, **dataclasses.asdict(found)})
        return
    print_rows([dataclasses.asdict(channel) for channel in found.channels], title=str(path))
    out.print(f"{found.messages} messages over {found.duration_s:.2f} s")


@app.command("recover")
def recover(
    path: LogFile,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The whole log to write.", show_default=False)
    ] = None,
) -> None:
    """Save every complete message of a log that was cut off."""
    from graspbench.cli.printing import out
    from graspbench.record import recover_log

    target = output or path.with_name(path.name.removesuffix(".partial").removesuffix(".mcap") + ".recovered.mcap")
    recovered = recover_log(path, target)
    out.print(f"{recovered.messages} messages saved in {target}")
