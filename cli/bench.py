"""``graspbench bench``: ratios against peers, measured in one run."""

from pathlib import Path
from typing import Annotated

import typer

from graspbench.cli.arguments import Json

_NAMES = ("clik",)


def _complete(incomplete: str) -> list[str]:
    return [name for name in _NAMES if name.startswith(incomplete)]


def bench(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME]...", help=", ".join(_NAMES), autocompletion=_complete),
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Where plots go.")] = Path("results/bench"),
    as_json: Json = False,
) -> None:
    """Measure this package against its peers in one run; ratios are what to quote."""
    from graspbench.bench import run_benchmarks
    from graspbench.cli.printing import err, out, print_json, print_rows

    document = {}
    for result in run_benchmarks(names or list(_NAMES), output, err.print):
        document[result.name] = {
            "rows": list(result.rows),
            "figures": [str(path) for path in result.figures],
        }
        if not as_json:
            print_rows(result.rows, title=result.name)
            for path in result.figures:
                out.print(f"picture   {path}")
    if as_json:
        only = len(document) == 1 and next(iter(document.values()))
        print_json({"schema": 1, **(only or document)})
