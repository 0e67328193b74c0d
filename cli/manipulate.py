"""``graspbench manipulate``: the hand moves the object it grasps."""

from pathlib import Path
from typing import Annotated

import typer

from graspbench.cli.arguments import ConfigDir, Json, Overrides
from graspbench.cli.run import Output, run_and_show

EXAMPLES = (
    "object=duck hand=allegro motion=screw",
    "object=sphere motion=rotate execution=default",
    "object=cube contact=rolling --range",
)


def manipulate(
    overrides: Overrides = None,
    output: Output = Path("results/manipulate"),
    as_json: Json = False,
    config_dir: ConfigDir = None,
    map_range: Annotated[
        bool,
        typer.Option("--range", help="First map how far the grasp can move the object: range.csv."),
    ] = False,
) -> None:
    """Plan a grasp, then move the object in the hand: manipulate object=duck hand=allegro motion=screw."""
    from graspbench.experiment import load_one_config

    given = [*(overrides or []), *(["motion.map_range=true"] if map_range else [])]
    run_and_show(load_one_config(given, config_dir, "manipulate"), output, as_json)
