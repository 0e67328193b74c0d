"""``graspbench bench``: ratios against peers, measured in one run."""

from pathlib import Path
from typing import Annotated

import typer

from graspbench.cli.arguments import Json

_NAMES = ("clik", "global", "planner", "quality", "reconstruction")


def _complete(incomplete: str) -> list[str]:
    return [name for name in _NAMES if name.startswith(incomplete)]


def bench(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME]...", help=", ".join(_NAMES), autocompletion=_complete),
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Where tables and plots go.")] = Path(
        "results/bench"
    ),
    objects: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...",
            help="Objects of the catalogue, instead of a few; reconstruction: also mesh files; planner: "
            "also 'all'.",
        ),
    ] = None,
    random: Annotated[
        int | None,
        typer.Option(min=0, metavar="N", help="planner: the first N random objects of pybullet_data too."),
    ] = None,
    quick: Annotated[
        bool | None, typer.Option("--quick", help="Measure once and roughly, to see whether it works.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Measure this package against its peers, or against bounds, in one run; ratios are what to quote."""
    from graspbench.bench import run_benchmarks
    from graspbench.bench.tables import write_bench
    from graspbench.cli.printing import out, print_json, print_rows
    from graspbench.cli.ticker import Saying

    document = {}
    chosen = None if objects is None else [name.strip() for name in objects.split(",") if name.strip()]
    options = {"objects": chosen, "random": random, "quick": quick}
    with Saying("bench", live=False) as saying:
        for result in run_benchmarks(names or list(_NAMES), output, saying.say, **options):
            files = write_bench(result, output)
            document[result.name] = {
                "rows": list(result.rows),
                **{name: list(rows) for name, rows in result.tables.items()},
                "figures": [str(path) for path in result.figures],
                "files": [str(path) for path in files],
            }
            if not as_json:
                print_rows(result.rows, title=result.name, columns=result.shown)
                for name, rows in result.tables.items():
                    print_rows(rows, title=f"{result.name}: {name}")
                for path in files:
                    out.print(f"table     {path}")
                for path in result.figures:
                    out.print(f"picture   {path}")
    if as_json:
        only = len(document) == 1 and next(iter(document.values()))
        print_json({"schema": 1, **(only or document)})
