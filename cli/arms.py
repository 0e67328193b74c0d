"""``graspbench arms``: what can carry a hand, and an arm of one's own."""

from pathlib import Path
from typing import Annotated

import typer

from graspbench.cli.arguments import ConfigDir, Json

app = typer.Typer(help="The arms there are; add your own.", no_args_is_help=True)


@app.callback()
def arms() -> None:
    """The arms there are; add your own."""


@app.command("list")
def list_arms(as_json: Json = False, config_dir: ConfigDir = None) -> None:
    """List what can carry a hand: a floating wrist, and arms with their joints."""
    from graspbench.cli.printing import print_json, print_rows
    from graspbench.experiment import describe_arms

    rows = describe_arms(config_dir)
    if as_json:
        print_json(rows)
    else:
        print_rows(rows, columns=list(dict.fromkeys(key for row in rows for key in row)))


@app.command()
def add(
    file: Annotated[
        str,
        typer.Argument(help="The arm's URDF file, or package://PACKAGE/PATH of an installed one."),
    ],
    name: Annotated[str | None, typer.Option(help="What to call the arm; by default as the file.")] = None,
    config_dir: Annotated[
        Path, typer.Option(help="Configuration folder to write to; made where there is none.")
    ] = Path("my_conf"),
    base: Annotated[str | None, typer.Option(help="The link that stands on the table.")] = None,
    tip: Annotated[str | None, typer.Option(help="The link that carries the hand.")] = None,
    package_dir: Annotated[
        list[Path] | None,
        typer.Option(help="A folder to look for package:// files in.", show_default=False),
    ] = None,
    as_json: Json = False,
) -> None:
    """Read an arm from a URDF file: its joints, the link that carries the hand, and the flange are found."""
    from graspbench.cli.printing import out, print_described, print_json
    from graspbench.experiment import add_arm
    from graspbench.simulation.arm_parameters import ArmParameters

    folders = tuple(str(folder) for folder in package_dir or ())
    found = add_arm(ArmParameters(urdf=file, base=base, tip=tip, package_dirs=folders), name, config_dir)
    if as_json:
        print_json(found)
        return
    print_described(found)
    out.print(
        f"next: graspbench run --config-dir {config_dir} arm={found['name']} object=cylinder", highlight=False
    )
