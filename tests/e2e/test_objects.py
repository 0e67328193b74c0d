"""``graspbench objects show | check``."""

import os

import pandas as pd
import trimesh
from PIL import Image

from tests.small import SMALL_TRIAL


def test_an_object_is_shown_with_its_picture(cli, tmp_path):
    document = cli("objects", "show", "sphere", "-o", tmp_path, "--json").document
    assert all(abs(length - 70.0) < 0.5 for length in document["extents_mm"])
    assert document["genus"] == 0
    assert document["watertight"]
    assert document["collision_pieces"] >= 1
    assert document["licence"]
    with Image.open(document["picture"]) as picture:
        assert picture.width > picture.height
        assert len(set(picture.convert("L").resize((60, 20)).getdata())) > 10


def test_an_unknown_object_is_refused_and_nothing_is_written(cli, tmp_path):
    finished = cli("objects", "show", "unicorn", "-o", tmp_path / "out")
    assert finished.code == 2
    assert "unicorn" in finished.stderr
    assert not (tmp_path / "out").exists()


def test_good_and_bad_meshes_are_told_apart(cli, tmp_path):
    good, hollow, text = tmp_path / "ball.stl", tmp_path / "open.stl", tmp_path / "text.stl"
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.03)
    ball.export(good)
    ball.update_faces(range(len(ball.faces) - 40))
    ball.export(hollow)
    text.write_text("no mesh at all")
    finished = cli("objects", "check", good, hollow, text, "--json")
    rows = finished.document["rows"]
    assert finished.code == 2
    assert [row["usable"] for row in rows] == [True, False, False]
    assert rows[1]["problems"][0]["repairable"]
    assert not rows[2]["problems"][0]["repairable"]
    assert [row["usable_after_repair"] for row in rows] == [True, True, False]
    assert rows[0]["verdict"] == "ball.stl can be used as it is."
    assert "object.repair=true makes it usable: 3 holes were closed" in rows[1]["verdict"]
    assert all(row["verdict"].endswith(".") and "\n" not in row["verdict"] for row in rows)


def test_a_repaired_copy_can_be_used(cli, tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=30.0)
    ball.update_faces(range(len(ball.faces) - 4))
    ball.export(tmp_path / "open.stl")
    copy = tmp_path / "closed.ply"
    finished = cli("objects", "check", tmp_path / "open.stl", "--scale", "0.001", "--repair", copy, "--json")
    assert finished.code == 0
    assert finished.document["rows"][0]["repairs"]
    assert cli("objects", "check", copy).code == 0


def test_a_copy_that_cannot_be_made_leaves_nothing(cli, tmp_path):
    (tmp_path / "text.stl").write_text("no mesh at all")
    finished = cli("objects", "check", tmp_path / "text.stl", "--repair", tmp_path / "copy.stl")
    assert finished.code == 2
    assert "text.stl" in finished.stderr
    assert not (tmp_path / "copy.stl").exists()


def test_meshes_of_one_file_name_are_rows_of_their_own(cli, tmp_path):
    for name, height in (("tin", 0.07), ("crate", 0.09)):
        (tmp_path / name).mkdir()
        trimesh.creation.box((0.05, 0.06, height)).export(tmp_path / name / "textured.obj")
    meshes = ",".join(str(tmp_path / name / "textured.obj") for name in ("tin", "crate"))
    quick = (*SMALL_TRIAL, "record=off")
    assert cli("sweep", f"object.mesh={meshes}", *quick, "--jobs", "0", "-o", tmp_path / "r").code == 0
    assert list(pd.read_csv(tmp_path / "r" / "trials.csv")["object.name"].sort_values()) == ["crate", "tin"]
    assert cli("report", tmp_path / "r", "--group", "object").code == 0
    groups = (tmp_path / "r" / "report" / "groups.md").read_text()
    assert "crate" in groups
    assert "tin" in groups
    mesh = f"object.mesh={tmp_path / 'tin' / 'textured.obj'}"
    named = cli("run", mesh, "object.name=banana", *quick, "-o", tmp_path / "one", "--json")
    assert named.document["object"]["name"] == "banana"


def test_files_without_an_end_are_refused_in_a_sentence(cli, tmp_path):
    os.mkfifo(tmp_path / "pipe.obj")
    (tmp_path / "memory.obj").symlink_to("/proc/self/mem")
    for mesh in ("/proc/self/mem", tmp_path / "pipe.obj", tmp_path / "memory.obj"):
        finished = cli("run", f"object.mesh={mesh}", "search.enabled=false", "execution=off", "record=off")
        assert finished.code == 2
        assert "Traceback" not in finished.stderr
        assert finished.stderr.strip().splitlines()[-1].startswith("graspbench: ")
