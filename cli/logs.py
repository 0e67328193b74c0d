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
    from graspbench.cli.ticker import Saying
    from graspbench.record import log_info

    with Saying(f"reading {path}"):
        found = log_info(path)
    if as_json:
        print_json({"schema": 1, **dataclasses.asdict(found)})
        return
    rows = [
        {"topic": topic, "messages": count, "schema": found.schemas[topic]}
        for topic, count in sorted(found.messages.items())
    ]
    print_rows(rows, title=str(path))
    state = (
        "complete" if found.complete else "cut off or damaged: 'graspbench log recover' saves what is there"
    )
    out.print(f"{found.message_count} messages over {found.duration_s:.2f} s, {state}")
    out.print(f"attached: {', '.join(found.attachments) or 'nothing'}")
    for lost in found.lost:
        out.print(f"lost: {lost}")


@app.command("recover")
def recover(
    path: LogFile,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The whole log to write.", show_default=False)
    ] = None,
) -> None:
    """Save all that is readable of a log that was cut off or damaged, and say what is lost."""
    from graspbench.cli.printing import out
    from graspbench.cli.ticker import Saying
    from graspbench.record import recover_log

    with Saying(f"reading {path} and saving what is there"):
        saved = recover_log(path, output)
    out.print(f"{saved.message_count} messages saved in {saved.path}")
    for lost in saved.lost:
        out.print(f"lost: {lost}")


@app.command("layout")
def layout(
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Where it goes; printed by default.", show_default=False),
    ] = None,
) -> None:
    """Print a layout for Foxglove: scene, camera image, joints, scores and messages of a trial's log."""
    from importlib.resources import files

    text = files("graspbench.record").joinpath("foxglove_layout.json").read_text(encoding="utf-8")
    if output is None:
        print(text, end="")
    else:
        output.write_text(text, encoding="utf-8")
