"""`graspbench manipulate` as a user meets it."""

import json

import cv2
import pandas as pd
import pytest
import yaml

from graspbench.record import log_info
from tests.small import SMALL_PICTURES

SHORT = ("motion.duration_s=1", "clik.step_s=0.005", "clik.integrator=rk4")


@pytest.fixture(scope="module")
def moved(cli, tmp_path_factory):
    output = tmp_path_factory.mktemp("manipulate") / "results"
    arguments = ("object=duck", "hand=allegro", "motion=screw", *SHORT)
    return cli("manipulate", *arguments, "--json", "-o", output), output


def test_allegro_carries_the_duck_along_a_screw(moved):
    finished, _ = moved
    assert finished.code == 0, finished.stderr
    result = finished.document
    assert result["schema"] == 3
    assert (result["status"], result["success"]) == ("done", True)
    assert (result["object"]["name"], result["hand"]["name"]) == ("duck", "allegro")
    figures = result["manipulation"]
    assert figures["duration_s"] == pytest.approx(1.0)
    assert figures["position_error_max_m"] <= 1e-4
    assert figures["rotation_error_max_deg"] <= 0.1
    assert figures["contact_drift_max_m"] <= 1e-6
    assert {"images", "local_planning", "manipulation"} <= set(result["times_s"])
    assert result["provenance"]["graspbench"]


def test_folder_holds_histories_picture_and_log(moved):
    finished, output = moved
    folder = output / finished.document["trial_id"]
    names = {path.name for path in folder.iterdir()}
    assert names == {"config.yaml", "result.json", "histories.csv", "manipulation.png", "manipulation.mcap"}
    assert not list(output.glob(".*"))
    assert json.loads((folder / "result.json").read_text()) == finished.document
    assert yaml.safe_load((folder / "config.yaml").read_text())["motion"]["duration_s"] == 1
    histories = pd.read_csv(folder / "histories.csv")
    assert len(histories) == 201
    lifted = histories["object_z_m"] - histories["object_z_m"][0]
    assert lifted[100] == pytest.approx(0.01, abs=1e-4)
    assert histories["turned_z_deg"][100] == pytest.approx(10.0, abs=0.1)
    assert lifted[200] == pytest.approx(0.0, abs=1e-4)
    picture = cv2.imread(str(folder / "manipulation.png"))
    assert picture is not None
    assert picture.std() > 5
    info = log_info(folder / "manipulation.mcap")
    assert info.complete
    assert info.messages["/joints"] == 51
    assert info.messages["/grasp"] == 1
    assert info.messages["/scores"] == 1
    assert list(pd.read_csv(output / "trials.csv")["status"]) == ["done"]


def test_a_motion_is_played_in_physics(cli, tmp_path):
    small = ("motion.translation_m=[0,0,0.004]", "motion.rotation_deg=[0,0,4]", *SHORT)
    finished = cli(
        "manipulate", "object=duck", "hand=radial", "contact=hard", "execution=default", *small, "--json",
        "-o", tmp_path,
    )  # fmt: skip
    assert finished.code == 0, finished.stderr
    planned = finished.document["manipulation"]
    assert planned["position_error_max_m"] <= 1e-4
    assert planned["rotation_error_max_deg"] <= 0.1
    assert planned["contact_drift_max_m"] <= 1e-6
    played = finished.document["in_hand"]
    assert played["success"]
    assert list(played["phases"]) == ["squeeze", "lift", "hold", "in_hand"]
    # the real object went along, and came back
    assert played["moved_max_m"] == pytest.approx(0.004, abs=1e-3)
    assert played["turned_max_deg"] == pytest.approx(4.0, abs=1.5)
    assert played["position_error_max_m"] < 1.5e-3
    assert played["rotation_error_max_deg"] < 2.0
    histories = played["histories"]
    assert len({len(values) for values in histories.values()}) == 1
    assert histories["times"][-1] == pytest.approx(1.5, abs=0.05)
    folder = tmp_path / finished.document["trial_id"]
    assert cv2.imread(str(folder / "in_hand.png")).std() > 5
    info = log_info(folder / "manipulation.mcap")
    assert info.complete
    assert info.messages["/joints"] > 50


def test_a_motion_out_of_reach_is_a_failed_result(cli, tmp_path):
    small = (*SMALL_PICTURES, "search.enabled=false", "record=off")
    far = ("object=duck", "hand=radial", "motion.translation_m=[0,0,0.3]", *SHORT, *small)
    finished = cli("manipulate", *far, "--json", "-o", tmp_path / "r")
    assert finished.code == 1
    result = finished.document
    assert (result["status"], result["success"]) == ("failed", False)
    assert result["reason"]
    assert "Traceback" not in finished.stderr


@pytest.mark.parametrize(
    ("override", "word"),
    [
        ("motion=scrw", "screw"),
        ("clik.tasks.wishing.gain=1", "wishing"),
        ("contact.kind=sticky", "contact.kind"),
        ("clik.tasks.joint_limit.joints=[99]", "joint_limit"),
    ],
)
def test_unusable_option_is_one_sentence_and_leaves_nothing(cli, tmp_path, override, word):
    finished = cli("manipulate", override, "-o", tmp_path / "results")
    assert finished.code == 2
    last = finished.stderr.strip().splitlines()[-1]
    assert last.startswith("graspbench: ")
    assert word in last
    assert finished.stdout == ""
    assert not (tmp_path / "results").exists()
