"""``graspbench manipulate``: the hand moves the object it grasps."""

from pathlib import Path

from graspbench.cli.arguments import ConfigDir, Json, Overrides
from graspbench.cli.run import Output, run_and_show


def manipulate(
    overrides: Overrides = None,
    output: Output = Path("results/manipulate"),
    as_json: Json = False,
    config_dir: ConfigDir = None,
) -> None:
    """Plan a grasp, then move the object in the hand: manipulate object=duck hand=allegro motion=screw."""
    from graspbench.experiment import load_one_config

    run_and_show(load_one_config(overrides or [], config_dir, "manipulate"), output, as_json)
