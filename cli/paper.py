"""``graspbench paper``: the thesis' experiments, by name."""

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import typer

from graspbench.cli.arguments import ConfigDir, Json
from graspbench.errors import ConfigurationError

_NAMES = ("table-3.1", "figures-3", "appendix-a", "case-study", "physical", "quality-study")


def _complete(incomplete: str) -> list[str]:
    return [name for name in _NAMES if name.startswith(incomplete)]


def paper(
    name: Annotated[str, typer.Argument(help=", ".join(_NAMES), autocompletion=_complete)],
    overrides: Annotated[
        list[str] | None,
        typer.Argument(metavar="[OVERRIDES]...", help="Hydra overrides of the trials.", show_default=False),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="results/NAME by default.", show_default=False),
    ] = None,
    jobs: Annotated[int, typer.Option(min=0, help="Trials at a time.")] = 1,
    forces: Annotated[
        bool, typer.Option("--forces", help="figures-3: draw force field and barrier at the contacts too.")
    ] = False,
    without: Annotated[
        Literal["hand", "ground"] | None,
        typer.Option(
            help="table-3.1: take away the hand or the ground, from planner and search alike.",
            show_default=False,
        ),
    ] = None,
    grasps: Annotated[
        int,
        typer.Option("--grasps", min=0, help="quality-study: try further grasps until there are so many."),
    ] = 0,
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Repeat an experiment of the thesis and set its figures beside the thesis' own; or one that it lacks."""
    from graspbench.cli.printing import out, print_json, print_rows
    from graspbench.cli.ticker import Saying
    from graspbench.paper.experiments import EXPERIMENTS
    from graspbench.paper.figures_3 import figures_3
    from graspbench.paper.quality_study import quality_study
    from graspbench.paper.table_3_1_without import table_3_1_without

    if name not in EXPERIMENTS:
        raise ConfigurationError(f"unknown experiment '{name}'", remedy=f"choose one of {', '.join(_NAMES)}")
    if forces and name != "figures-3":
        raise ConfigurationError(f"'{name}' draws no forces", remedy="use --forces with figures-3")
    if without is not None and name != "table-3.1":
        raise ConfigurationError(
            f"'{name}' is not compared without the {without}", remedy="use --without with table-3.1"
        )
    if grasps and name != "quality-study":
        raise ConfigurationError(f"'{name}' collects no grasps", remedy="use --grasps with quality-study")
    experiment = EXPERIMENTS[name]
    if grasps:
        experiment = partial(quality_study, grasps=grasps)
    if forces:
        experiment = partial(figures_3, forces=True)
    if without is not None:
        experiment, name = partial(table_3_1_without, without=without), f"{name}-without-{without}"
    with Saying(name) as saying:
        done = experiment(output or Path("results") / name, overrides or [], jobs, config_dir, saying.say)
    if as_json:
        print_json({"schema": 1, **done.document})
        return
    print_rows(done.rows, title=name)
    for path in done.files:
        out.print(f"written   {path}")
