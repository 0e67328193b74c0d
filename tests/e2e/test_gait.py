"""`graspbench manipulate motion=gait` as a user meets it."""

import json

import pandas as pd
import pytest

SHORT = (
    "clik.step_s=0.005",
    "clik.integrator=rk4",
    "motion.gait.turn_speed_deg_s=40",
    "record.pictures=false",
)


def test_a_sphere_is_turned_on_by_steps(cli, tmp_path):
    arguments = ("object=sphere", "hand.fingers=4", "motion=gait", "motion.gait.angle_deg=150", *SHORT)
    finished = cli("manipulate", *arguments, "--json", "-o", tmp_path)
    assert finished.code == 0, finished.stderr
    result = finished.document
    assert (result["status"], result["success"]) == ("done", True)
    gait, figures = result["gait"], result["manipulation"]
    assert gait["verified"]
    assert gait["violations"] == []
    assert gait["turned_deg"] == pytest.approx(150.0, abs=0.1)
    assert gait["steps"] >= 3
    assert max(gait["position_error_max_m"], figures["position_error_max_m"]) <= 1e-4
    assert max(gait["rotation_error_max_deg"], figures["rotation_error_max_deg"]) <= 0.1
    assert gait["joint_margin_min_deg"] > 0.0
    assert gait["friction_margin_min_n"] > 0.0
    assert figures["balanced_share"] == 1.0
    histories = pd.read_csv(tmp_path / result["trial_id"] / "histories.csv")
    # a finger that steps has no contact
    steps = histories[[f"contact_{i}_x_m" for i in range(4)]].isna()
    assert steps.to_numpy().any(axis=0).sum() >= 3
    assert steps.sum(axis=1).max() == 1


def test_a_gait_that_cannot_be_done_is_refused_with_how_far_it_goes(cli, tmp_path):
    """Two of three fingers do not hold the sphere with so much to spare while the third steps."""
    hard = ("motion.gait.angle_deg=300", "motion.gait.friction_reserve=0.9", "motion.gait.starts=1")
    arguments = (
        "object=sphere",
        "motion=gait",
        *hard,
        "surface.meridians=14",
        "surface.parallels=13",
        *SHORT,
    )
    finished = cli("manipulate", *arguments, "--json", "-o", tmp_path)
    assert finished.code == 1
    result = finished.document
    assert result["status"] == "failed"
    assert "can turn the object only" in result["reason"]
    assert "by the best of 2 grasps" in result["reason"]
    assert "motion.gait.angle_deg=" in finished.stderr + str(result)
    assert result["gait"] is None


def test_a_gait_is_played_in_physics(cli, tmp_path):
    arguments = ("object=sphere", "hand=allegro", "hand.fingers=4", "motion=gait", "execution=default")
    quick = ("motion.gait.angle_deg=30", "motion.gait.step_time_s=0.5", "execution.lift_time_s=0.5")
    finished = cli("run", *arguments, *quick, *SHORT, "-o", tmp_path)
    assert finished.code == 0, finished.stderr
    result = json.loads(next(tmp_path.glob("*/result.json")).read_text())
    played = result["in_hand"]
    assert played["success"]
    assert played["steps"] == result["gait"]["steps"] >= 1
    assert played["steps_missed"] == played["fingers_slipped"] == 0
    # in truth, from the physics' own poses, and against its weight
    assert played["turned_about_axis_deg"] == pytest.approx(30.0, abs=2.0)
    assert played["position_error_max_m"] < 2e-3
    assert played["phases"]["in_hand"]["contacts_lost"] == 1
    said = " ".join(finished.stdout.split())
    assert f"with {played['steps']} steps of single fingers; in physics it was held and turned by" in said


def test_an_object_that_slips_from_the_fingers_is_a_failed_gait(cli, tmp_path):
    """With less friction in physics than was planned with."""
    arguments = ("object=cube", "hand.fingers=4", "motion=gait", "motion.gait.angle_deg=20")
    slippery = ("execution=default", "execution.friction=0.05", *SHORT)
    finished = cli("manipulate", *arguments, *slippery, "--json", "-o", tmp_path)
    assert finished.code == 1
    result = finished.document
    assert (result["status"], result["success"]) == ("failed", False)
    assert result["reason"].startswith("played in physics: ")
    assert not result["in_hand"]["success"]
    assert result["gait"]["verified"]
