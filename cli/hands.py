"""``graspbench hands``: the hands there are, one of one's own, and what may be wrong with it."""

from pathlib import Path
from typing import Annotated

import typer

from graspbench.cli.arguments import ConfigDir, Json

app = typer.Typer(help="The hands there are; add, draw and check your own.", no_args_is_help=True)

_Name = Annotated[str, typer.Argument(help="An option of the group 'hand'.")]
_Overrides = Annotated[list[str] | None, typer.Argument(help="Options such as hand.fingers=4.")]


@app.callback()
def hands() -> None:
    """The hands there are; add, draw and check your own."""


@app.command("list")
def list_hands(as_json: Json = False, config_dir: ConfigDir = None) -> None:
    """List the hands with their fingers, joints and reach."""
    from graspbench.cli.printing import print_json, print_rows
    from graspbench.experiment import describe_hands

    rows = describe_hands(config_dir)
    if as_json:
        print_json(rows)
    else:
        print_rows(rows)


@app.command()
def add(
    file: Annotated[
        str,
        typer.Argument(help="The hand's URDF or MJCF file, or package://PACKAGE/PATH of an installed one."),
    ],
    name: Annotated[str | None, typer.Option(help="What to call the hand; by default as the file.")] = None,
    config_dir: Annotated[
        Path, typer.Option(help="Configuration folder to write to; made where there is none.")
    ] = Path("my_conf"),
    palm: Annotated[str | None, typer.Option(help="The palm's link.")] = None,
    approach: Annotated[
        str | None, typer.Option(help="Direction from palm to object in the palm's link, as X,Y,Z.")
    ] = None,
    fingers: Annotated[int | None, typer.Option(min=2, max=5, help="How many fingers to use.")] = None,
    drop: Annotated[list[str] | None, typer.Option(help="A finger to leave out.", show_default=False)] = None,
    tip: Annotated[
        list[str] | None,
        typer.Option(help="Centre of a tip, FINGER=LINK:X,Y,Z in mm.", show_default=False),
    ] = None,
    tip_radius_mm: Annotated[float | None, typer.Option(help="Radius of the fingertips.")] = None,
    tip_shape: Annotated[
        str, typer.Option(help="What touches: sphere, at the tips, or link, the last links as they are.")
    ] = "sphere",
    posture: Annotated[
        list[str] | None,
        typer.Option(help="Posture of a grasp, FINGER=A,B,C in deg (slides: mm).", show_default=False),
    ] = None,
    rest: Annotated[
        list[str] | None,
        typer.Option(help="Posture out of the way, FINGER=A,B,C in deg (slides: mm).", show_default=False),
    ] = None,
    lock: Annotated[
        list[str] | None,
        typer.Option(help="A joint to hold, JOINT=DEG (slides: mm).", show_default=False),
    ] = None,
    object_mm: Annotated[float, typer.Option(help="Width of the object that the posture is for.")] = 60.0,
    package_dir: Annotated[
        list[Path] | None,
        typer.Option(help="A folder to look for package:// files in.", show_default=False),
    ] = None,
    as_json: Json = False,
) -> None:
    """Read a hand from a URDF or MJCF file: palm, fingers, tips and a posture are found, and can be given."""
    from graspbench.cli.printing import out, print_described, print_json
    from graspbench.experiment import add_hand
    from graspbench.hand.importing.guesses import guesses_of

    guesses = guesses_of(
        palm=palm,
        approach=approach,
        fingers=fingers,
        drop=drop or (),
        tips=tip or (),
        tip_radius_mm=tip_radius_mm,
        tip_shape=tip_shape,
        postures=posture or (),
        rests=rest or (),
        locks=lock or (),
        object_mm=object_mm,
        package_dirs=[str(folder) for folder in package_dir or ()],
    )
    from graspbench.cli.ticker import Saying

    with Saying(f"reading {file}"):
        found = add_hand(file, name, guesses, config_dir)
    if as_json:
        print_json(found)
        return
    print_described(found)
    used = f"--config-dir {config_dir} hand={found['name']}"
    if len(found["used"]) == 2:  # two points with friction hold nothing: it turns about the line between
        used += " quality.contact=soft_finger"
    out.print(f"next: graspbench hands check --config-dir {config_dir} {found['name']}", highlight=False)
    out.print(f"      graspbench run {used} object=cylinder", highlight=False)


@app.command()
def show(
    name: _Name,
    overrides: _Overrides = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the picture.")] = Path(
        "results/hands"
    ),
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Draw a hand open and closed, with its palm frame and fingertips."""
    from graspbench.cli.printing import print_described, print_json
    from graspbench.cli.ticker import Saying
    from graspbench.experiment import show_hand

    with Saying(f"drawing {name}"):
        described = show_hand(name, overrides or [], output, config_dir)
    if as_json:
        print_json(described)
    else:
        print_described(described)


@app.command()
def check(
    name: _Name,
    overrides: _Overrides = None,
    hold: Annotated[bool, typer.Option(help="Try to hold a sphere and a cylinder too.")] = True,
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Say what may be wrong with a hand, and what to do; exit code 1 if something is."""
    from dataclasses import asdict

    from graspbench.cli.printing import out, print_json
    from graspbench.cli.ticker import Saying
    from graspbench.experiment import check_hand

    rows = []
    with Saying(f"checking {name}", live=as_json) as saying:
        for finding in check_hand(name, overrides or [], config_dir, hold=hold):
            rows.append(asdict(finding))
            if not as_json:
                text = f"{finding.verdict:6} {finding.aspect:20} {finding.sentence}"
                out.print(text, highlight=False, markup=False, soft_wrap=True)
            saying.now(f"checking {name} after {finding.aspect}")
    usable = all(row["verdict"] != "fault" for row in rows)
    if as_json:
        print_json({"schema": 1, "hand": name, "usable": usable, "rows": rows})
    if not usable:
        raise typer.Exit(1)
