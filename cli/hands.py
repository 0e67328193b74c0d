"""``graspbench hands``: the hands there are."""

import typer

from graspbench.cli.arguments import Json

app = typer.Typer(help="The hands there are.", no_args_is_help=True)


@app.callback()
def hands() -> None:
    """The hands there are."""


@app.command("list")
def list_hands(as_json: Json = False) -> None:
    """List the hands with their fingers, joints and reach."""
    from graspbench.cli.printing import print_json, print_rows
    from graspbench.experiment import describe_hands

    rows = describe_hands()
    if as_json:
        print_json(rows)
    else:
        print_rows(rows)
