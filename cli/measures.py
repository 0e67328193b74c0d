"""``graspbench measures``: the measures of grasps there are."""

import typer

from graspbench.cli.arguments import Json

app = typer.Typer(help="The measures of grasps there are.", no_args_is_help=True)


@app.callback()
def measures() -> None:
    """The measures of grasps there are."""


@app.command("list")
def list_measures(as_json: Json = False) -> None:
    """List the measures with their definition, range, unit and source."""
    from graspbench.cli.printing import print_json, print_rows
    from graspbench.grasp.measure import describe_measures

    rows = describe_measures()
    if as_json:
        print_json(rows)
    else:
        print_rows(rows)
