"""`graspbench run` as a user meets it."""

import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd
import pytest
import trimesh

from graspbench.record import log_info
from tests.small import SMALL_PICTURES


def _stable(tree: Any) -> Any:
    """Leave out what may differ between two runs: times, what had to be compiled, and provenance."""
    if isinstance(tree, dict):
        return {
            key: _stable(value)
            for key, value in tree.items()
            if key not in {"time_s", "times_s", "first_s", "best_s", "compiled", "provenance"}
            and not key.endswith("_time_s")
        }
    return [_stable(item) for item in tree] if isinstance(tree, list) else tree


def test_trial_gives_a_scored_and_executed_grasp(teddy_run):
    finished, _ = teddy_run
    assert finished.code == 0, finished.stderr
    result = finished.document
    assert result["schema"] == 3
    assert result["status"] == "done"
    assert result["object"]["name"] == "teddy"
    assert len(result["local"]["contacts"]) == 3
    assert result["local"]["force_closure"] is True
    assert result["local"]["verified"] is True
    assert result["local"]["violations"] == []
    for measure in ("q1", "q2", "q3"):
        assert result["local"][measure] > 0
        assert result["global"][measure]["value"] >= result["local"][measure] * (1 - 1e-9)
        assert result["ratio"][measure] == pytest.approx(
            result["local"][measure] / result["global"][measure]["value"]
        )
    assert result["execution"]["contacts_made"] == 3
    assert result["success"] is True
    assert {"images", "silhouettes", "reconstruction", "local_planning"} <= set(result["times_s"])


def test_trial_folder_holds_record_pictures_and_tables(teddy_run):
    finished, output = teddy_run
    folder = output / finished.document["trial_id"]
    names = {path.name for path in folder.iterdir()}
    assert names == {
        "config.yaml",
        "result.json",
        "trial.mcap",
        "views.png",
        "surface.png",
        "grasp.png",
        "hand.png",
        "geometry.jsonl",
    }
    assert not list(output.glob(".*"))
    assert json.loads((folder / "result.json").read_text()) == finished.document
    info = log_info(folder / "trial.mcap")
    assert info.complete
    assert info.messages["/camera/image"] == 13
    assert info.attachments["config.yaml"] == (folder / "config.yaml").read_text()
    for picture in folder.glob("*.png"):
        pixels = cv2.imread(str(picture))
        assert pixels is not None
        assert pixels.std() > 5, f"{picture.name} is blank"
    table = pd.read_csv(output / "trials.csv")
    assert list(table["status"]) == ["done"]
    assert table["local.q1"][0] == pytest.approx(finished.document["local"]["q1"])


def test_same_seed_gives_the_same_result(teddy_run, cli, tmp_path):
    first = teddy_run[0].document
    second = cli("run", "--json", "-o", tmp_path / "again").document
    assert _stable(second) == _stable(first)


def test_bottle_with_four_fingers(cli, tmp_path):
    # The thesis' rule wants equal angles; the default moves a grasp at rest on towards equilibrium.
    bottle = ("object=bottle", "hand=radial", "hand.fingers=4", "index.rest=single", "search.enabled=false")
    finished = cli("run", *bottle, "--json", "--video", "record.pictures=false", "-o", tmp_path / "r")
    assert finished.code == 0, finished.stderr
    result = finished.document
    assert len(result["local"]["contacts"]) == 4
    film = cv2.VideoCapture(str(tmp_path / "r" / result["trial_id"] / "execution.mp4"))
    assert 40 < film.get(cv2.CAP_PROP_FRAME_COUNT) <= 90  # approach, lift and turn
    points = np.array([contact["point"] for contact in result["local"]["contacts"]])
    in_plane = (points - points.mean(axis=0)) @ np.linalg.svd(points - points.mean(axis=0))[2][:2].T
    angles = np.sort(np.degrees(np.arctan2(in_plane[:, 1], in_plane[:, 0])))
    gaps = np.diff(np.concatenate((angles, angles[:1] + 360)))
    assert np.abs(gaps - 90).max() < 15


def test_duck_with_allegro(cli, tmp_path):
    quick = ("search.enabled=false", "record=off", "execution.until=contact")
    finished = cli("run", "object=duck", "hand=allegro", *quick, "--json", "-o", tmp_path / "r")
    assert finished.code == 0, finished.stderr
    assert finished.document["hand"]["name"] == "allegro"
    assert finished.document["execution"]["contacts_made"] >= 2


def test_own_mesh_in_millimetres_without_the_inner_ring(cli, tmp_path):
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=32.0)
    mesh.export(tmp_path / "ball.stl")
    finished = cli(
        "run",
        "object.mesh=ball.stl",
        "object.scale=0.001",
        *SMALL_PICTURES,  # without the inner ring
        "index.k_cm=0",
        "search.enabled=false",
        "execution=off",
        "--json",
        cwd=tmp_path,
    )
    assert finished.code == 0, finished.stderr
    result = finished.document
    assert result["object"]["name"] == "ball"
    assert result["config"]["stations"]["inner"]["count"] == 0
    assert result["index"]["k_cm"] == 0
    assert (tmp_path / "results" / "run" / result["trial_id"] / "views.png").is_file()


def _open(folder: Path) -> Path:
    sphere = trimesh.creation.icosphere(subdivisions=2, radius=0.03)
    sphere.update_faces(np.arange(len(sphere.faces)) > 20)
    sphere.export(folder / "open.stl")
    return folder / "open.stl"


def _two_bodies(folder: Path) -> Path:
    left, right = trimesh.creation.icosphere(radius=0.02), trimesh.creation.icosphere(radius=0.02)
    right.apply_translation([0.1, 0, 0])
    trimesh.util.concatenate([left, right]).export(folder / "two.stl")
    return folder / "two.stl"


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda folder: folder / "nothing.stl", "nothing.stl"),
        (_open, "open"),
        (_two_bodies, "bod"),
    ],
    ids=["missing", "open", "two bodies"],
)
def test_unusable_mesh_is_one_sentence_and_leaves_nothing(cli, tmp_path, make, word):
    finished = cli("run", f"object.mesh={make(tmp_path)}", "-o", tmp_path / "results")
    _assert_refused(finished, word)
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("override", "word"),
    [
        ("object=tedy", "teddy"),
        ("hand.fingerz=4", "hand.fingers"),
        ("hand.fingers=9", "hand.fingers"),
        ("index.k_cm=[1", "index.k_cm"),
        ("surface.margin=-1", "surface.margin"),
        ("nonsense", "nonsense"),
        ("object=teddy,duck", "sweep"),
        ("stations.outer.radius_m=0", "outer"),
        ("seed=-3", "seed"),
    ],
)
def test_unusable_option_is_one_sentence_and_leaves_nothing(cli, tmp_path, override, word):
    finished = cli("run", override, "-o", tmp_path / "results")
    _assert_refused(finished, word)
    assert not (tmp_path / "results").exists()


def test_log_info_and_recovery_of_a_cut_log(cli, teddy_run, tmp_path):
    finished, output = teddy_run
    log = output / finished.document["trial_id"] / "trial.mcap"
    whole = cli("log", "info", log, "--json").document
    cut = tmp_path / "cut.mcap.partial"
    shutil.copy(log, cut)
    with cut.open("r+b") as stream:
        stream.truncate(cut.stat().st_size * 2 // 3)
    assert cli("log", "recover", cut).code == 0
    saved = cli("log", "info", tmp_path / "cut.mcap", "--json").document
    assert saved["complete"]
    assert saved["messages"]["/camera/image"] == 13
    assert 0 < sum(saved["messages"].values()) < sum(whole["messages"].values())


def test_object_larger_than_the_hand_is_refused(cli, tmp_path):
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
    mesh.export(tmp_path / "globe.stl")
    finished = cli("run", f"object.mesh={tmp_path / 'globe.stl'}", "-o", tmp_path / "results")
    _assert_refused(finished, "hand")
    assert not (tmp_path / "results").exists()


def _assert_refused(finished, word):
    assert finished.code == 2, finished.stdout + finished.stderr
    last = finished.stderr.strip().splitlines()[-1]
    assert last.startswith("graspbench: ")
    assert word in last
    assert "Traceback" not in finished.stderr
    assert finished.stdout == ""
