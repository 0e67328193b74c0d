"""``graspbench objects``: the catalogue, and whether a mesh can be used."""

import typer

from graspbench.cli.arguments import Json

app = typer.Typer(help="The catalogue of objects, and whether a mesh can be used.", no_args_is_help=True)


@app.command("list")
def list_catalogue(as_json: Json = False) -> None:
    """List the objects of the catalogue."""
    from graspbench.cli.printing import print_json, print_rows
    from graspbench.experiment import describe_objects

    rows = describe_objects()
    if as_json:
        print_json({"schema": 1, "rows": rows})
    else:
        print_rows(rows)
