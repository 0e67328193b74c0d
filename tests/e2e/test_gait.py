"""`graspbench manipulate motion=gait` as a user meets it."""

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
    # a finger that steps has no contact: its cells are empty
    steps = histories[[f"contact_{i}_x_m" for i in range(4)]].isna()
    assert steps.to_numpy().any(axis=0).sum() >= 3
    assert steps.sum(axis=1).max() == 1


def test_a_gait_that_cannot_be_done_is_refused_with_how_far_it_goes(cli, tmp_path):
    """Two of three fingers do not hold the cube while the third steps."""
    arguments = ("object=cube", "motion=gait", "motion.gait.angle_deg=300", *SHORT)
    finished = cli("manipulate", *arguments, "--json", "-o", tmp_path)
    assert finished.code == 1
    result = finished.document
    assert result["status"] == "failed"
    assert "can turn the object only" in result["reason"]
    assert "motion.gait.angle_deg=" in finished.stderr + str(result)
    assert result["gait"] is None
