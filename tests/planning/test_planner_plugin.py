"""A planner from another distribution: one file, found, configured and run by the real command line."""

import json
import os
import subprocess
import sys
from pathlib import Path

from tests.small import SMALL_TRIAL

PLUG_IN = Path(__file__).parent / "plug_in"
ROOT = Path(__file__).parents[2]


def graspbench(*arguments):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(PLUG_IN), str(ROOT)])}
    command = [sys.executable, "-m", "graspbench.cli", *map(str, arguments)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def test_a_planner_from_outside_is_an_option_with_its_own_parameters():
    done = graspbench("config", "planner=ring", "planner.turns=5", "planner.paths.retreat_m=0.05", "--json")
    assert done.returncode == 0, done.stderr
    planner = json.loads(done.stdout)["planner"]
    assert planner["name"] == "ring"
    assert planner["turns"] == 5
    assert planner["above_m"] == 0.0
    assert planner["paths"]["retreat_m"] == 0.05
    assert "followers" not in planner


def test_a_trial_is_planned_by_it_and_says_so(tmp_path):
    options = ("object=cylinder", *SMALL_TRIAL, "record=off")
    done = graspbench("run", *options, "planner=ring", "-o", tmp_path / "r", "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["planned"]["planner"] == "ring"
    assert 1 <= result["planned"]["grasps"] <= 12
    assert 0.0 < result["planned"]["first_s"] <= result["planned"]["best_s"]
    assert result["local"]["verified"] is True
    assert result["local"]["found_by"] is None


def test_an_option_of_another_planner_is_refused_in_one_sentence():
    done = graspbench("config", "planner=ring", "planner.followers=3")
    assert done.returncode == 2
    assert "unknown option 'planner.followers'" in done.stderr
