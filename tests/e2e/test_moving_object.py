"""An object that moves while it is looked at and grasped, through the real command line."""

import csv
from itertools import pairwise

import pytest
from mcap.reader import make_reader

CHEAP = ("object=cylinder", "search.enabled=false", "record.pictures=false", "execution.rotation_deg=0")


def test_a_moving_can_is_followed_lifted_and_reported(cli, tmp_path):
    finished = cli("run", *CHEAP, "scene=conveyor", "-o", tmp_path, "--json")
    assert finished.code == 0, finished.stderr
    moving = finished.document["moving"]
    assert moving["motion"] == "conveyor"
    assert moving["true_speed_m_s"] == pytest.approx(0.1, abs=2e-3)
    assert moving["velocity_error_m_s"] < 1e-3
    assert moving["path_error_max_mm"] < 1.0
    assert moving["start_error_mm"] < 2.0
    assert finished.document["success"] is True
    assert finished.document["execution"]["phases"]["lift"]["held"] is True
    assert finished.document["reconstruction"]["mesh_mean_mm"] < 1.2

    (log,) = tmp_path.glob("*/trial.mcap")
    with log.open("rb") as stream:
        stamps = [
            message.log_time
            for schema, channel, message in make_reader(stream).iter_messages(topics=["/camera/image"])
        ]
    assert len(stamps) == 13
    gaps_s = {round((b - a) * 1e-9, 3) for a, b in pairwise(stamps)}
    assert gaps_s == {0.4}  # the times at which they were taken

    assert cli("report", tmp_path, "--group", "scene.motion").code == 0
    with (tmp_path / "trials.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["moving.true_speed_m_s"]) == pytest.approx(0.1, abs=2e-3)
    assert row["moving.varies"] == "False"


@pytest.mark.parametrize(
    ("command", "overrides", "what"),
    [
        ("run", ("scene=images", "scene.images_dir=photos", "scene.motion=drift"), "images from files"),
        ("manipulate", ("scene.motion=conveyor",), "in-hand motions"),
        ("run", ("scene.motion=escalator",), "scene.motion"),
        ("run", ("scene.motion=conveyor", "scene.travel.speed_m_s=-1"), "scene.travel.speed_m_s"),
    ],
)
def test_what_cannot_move_is_refused_in_a_sentence(cli, tmp_path, command, overrides, what):
    finished = cli(command, *overrides, "-o", tmp_path)
    assert finished.code == 2
    assert what in finished.stderr
    assert not list(tmp_path.iterdir())
