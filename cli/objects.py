"""``graspbench objects``: the catalogue, an object in detail, and whether a mesh can be used."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from graspbench.cli.arguments import ConfigDir, Json, complete_object

app = typer.Typer(help="The catalogue of objects, and whether a mesh can be used.", no_args_is_help=True)


@app.command("list")
def list_catalogue(
    properties: Annotated[
        bool, typer.Option("--properties", help="Load every object: size, mass, friction, topology, source.")
    ] = False,
    as_json: Json = False,
) -> None:
    """List the objects of the catalogue."""
    from graspbench.cli.printing import print_json, print_rows
    from graspbench.experiment import describe_objects

    rows = describe_objects(properties=properties)
    if as_json:
        print_json({"schema": 1, "rows": rows})
    else:
        print_rows(rows)


@app.command()
def show(
    name: Annotated[
        str,
        typer.Argument(
            help="Object of the catalogue, or 'random', 'mesh', 'folder'.", autocompletion=complete_object
        ),
    ],
    overrides: Annotated[list[str] | None, typer.Argument(help="Options such as object.id=137.")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the picture.")] = Path(
        "results/objects"
    ),
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Show one object: size, mass, topology, collision pieces, licence, and a picture."""
    from graspbench.cli.printing import print_json
    from graspbench.cli.ticker import Saying
    from graspbench.experiment import show_object

    with Saying(f"describing {name}"):
        described, picture = show_object([f"object={name}", *(overrides or [])], output, config_dir)
    if as_json:
        print_json(described | {"picture": str(picture)})
    else:
        _print_properties(described | {"picture": str(picture)})


@app.command()
def check(
    files: Annotated[list[Path], typer.Argument(help="Mesh files.")],
    scale: Annotated[str, typer.Option(help="Metres per unit of the files, or 'guess'.")] = "1",
    repair: Annotated[
        Path | None, typer.Option(help="Write a usable copy of the (one) mesh here, in metres.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Say whether and how meshes can be used; exit code 2 if one cannot."""
    from graspbench.cli.printing import print_json
    from graspbench.cli.ticker import Saying
    from graspbench.errors import ConfigurationError
    from graspbench.experiment import check_object, repair_object

    if repair is not None and len(files) > 1:
        raise ConfigurationError(f"--repair with {len(files)} files", remedy="repair one file at a time")
    found = []
    for file in files:
        with Saying(f"checking {file}"):
            if repair is None:
                found.append(check_object(file, _scale(scale)))
            else:
                found.append(repair_object(file, _scale(scale), repair))
    if as_json:
        print_json({"schema": 1, "rows": found})
    else:
        for each in found:
            _print_properties(each)
    if not all(each["usable"] for each in found):
        raise typer.Exit(2)


def _scale(text: str) -> float | Literal["guess"]:
    from graspbench.errors import ConfigurationError

    if text == "guess":
        return "guess"
    try:
        if 0.0 < (scale := float(text)) < math.inf:
            return scale
    except ValueError:
        pass
    raise ConfigurationError(
        f"--scale {text} is no factor", remedy="give metres per unit such as 0.001, or 'guess'"
    )


def _print_properties(described: dict[str, Any]) -> None:
    from graspbench.cli.printing import out
    from graspbench.report.tables import value_text

    for key, value in described.items():
        if isinstance(value, list):
            lines = [item["sentence"] if isinstance(item, dict) else item for item in value]
            if key == "problems" or (lines and isinstance(lines[0], str)):
                for line in lines:
                    out.print(f"{key:17} {line}", highlight=False, markup=False)
                continue
            value = ", ".join(
                value_text(item) if not isinstance(item, list) else _row(item) for item in lines
            )
            if not value:
                continue
        text = value if isinstance(value, str) else value_text(value)
        out.print(f"{key:17} {text}", highlight=False, markup=False)


def _row(values: list[float]) -> str:
    return "[" + " ".join(f"{value:.3g}" for value in values) + "]"
