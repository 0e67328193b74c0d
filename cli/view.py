"""``graspbench view``: the results in a browser."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer


def view(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[RESULTS]...", help="Results folders; merged.", show_default="results"),
    ] = None,
    show: Annotated[
        bool, typer.Option("--open/--no-open", help="Open a browser, or only write the page and say where.")
    ] = True,
) -> None:
    """Write the page of one or more results folders and open it in a browser."""
    from graspbench.cli.printing import err, out
    from graspbench.cli.ticker import Saying

    chosen = folders or [Path("results")]
    with Saying("reading the results and writing their page"):
        from graspbench.report.results_page import write_results_page

        path = write_results_page(chosen, chosen[0] / "report").resolve()
    out.print(f"page      {path}")
    if show and not webbrowser.open(path.as_uri()):
        err.print("no browser could be started here; open the page with yours")
