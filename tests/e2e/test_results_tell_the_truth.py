"""What a results folder says must be true whatever was swept."""

import json
import re
import shlex

import numpy as np
import pandas as pd
import pytest
import trimesh

from graspbench.config.reference import configuration_reference
from graspbench.results.columns import describe_column
from tests.small import SHORT_EXECUTION, SMALL_PICTURES

# A short trial: few small pictures, a coarse surface, no search, nothing executed.
QUICK = (
    "experiment=quick", "surface.meridians=16", "surface.parallels=15", "planner.candidates=1",
    *SMALL_PICTURES,
)  # fmt: skip


def _timeless(part):
    return {k: v for k, v in part.items() if not k.endswith("time_s")} if isinstance(part, dict) else part


@pytest.fixture(scope="module")
def swept(cli, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep") / "grid"
    grid = ("object=sphere", "surface=thesis,smooth", "camera.width=160,200", "scene.yaw_deg=0,90")
    finished = cli("sweep", *QUICK, *grid, "--jobs", 0, "-o", folder)
    assert finished.code == 0, finished.stderr
    return folder, pd.read_csv(folder / "trials.csv")


def test_a_trial_that_executed_nothing_is_no_success(swept, cli):
    folder, table = swept
    assert table["success"].isna().all()
    finished = cli("report", folder, "--group", "object", "--format", "csv", "--json")
    assert finished.code == 0, finished.stderr
    grouped = pd.read_csv(folder / "report" / "groups.csv")
    assert not any("success" in name and grouped[name].notna().any() for name in grouped if "rate" in name)


def test_every_choice_and_override_is_a_column(swept):
    _, table = swept
    assert sorted(set(table["choice.surface"])) == ["smooth", "thesis"]
    assert sorted(set(table["camera.width"])) == [160, 200]
    assert sorted(set(table["scene.yaw_deg"])) == [0, 90]
    assert list(table.columns[:4]) == ["trial_id", "status", "reason", "success"]
    assert list(table.columns).index("camera.width") < list(table.columns).index("seed")


def test_a_swept_key_that_a_result_has_too_is_what_was_asked_for(cli, tmp_path):
    grid = ("object=sphere", "execution.friction=0.4,0.6", "execution.grip_force_n=3,4")
    assert cli("sweep", *QUICK, *grid, "--jobs", 0, "-o", tmp_path / "r").code == 0
    table = pd.read_csv(tmp_path / "r" / "trials.csv")
    assert sorted(table["execution.friction"]) == [0.4, 0.4, 0.6, 0.6]
    assert sorted(table["execution.grip_force_n"]) == [3, 3, 4, 4]
    finished = cli("report", tmp_path / "r", "--format", "markdown")
    assert finished.code == 0, finished.stderr
    for name in ("execution.friction", "execution.grip_force_n"):
        assert name in (tmp_path / "r" / "report" / "table.md").read_text().replace("\\", "")


def test_swept_options_can_be_grouped_by(swept, cli):
    folder, _ = swept
    finished = cli("report", folder, "--group", "camera.width,choice.surface", "--format", "csv", "--json")
    assert finished.code == 0, finished.stderr
    assert len(pd.read_csv(folder / "report" / "groups.csv")) == 4


def test_every_column_is_in_the_dictionary(swept, cli, tmp_path):
    _, table = swept
    searched = cli(
        "run", "object=sphere", *QUICK[1:], "record=off", "search.measures=[q1,mirtich_canny]",
        "search.refine=true", "quality.measures=[polygon_area]", "execution=shakes", *SHORT_EXECUTION,
        "-o", tmp_path,
    )  # fmt: skip
    assert searched.code == 0, searched.stderr
    names = {*table.columns, *pd.read_csv(tmp_path / "trials.csv").columns}
    meanings = re.findall(r"^\| `([^`]+)` \|", configuration_reference(), re.MULTILINE)
    assert [name for name in sorted(names) if describe_column(name) is None and name not in meanings] == []
    assert {"global.mirtich_canny.value", "refined.q1.value", "execution.phases.shake_x.held"} <= names


def test_free_text_never_becomes_a_column(swept):
    _, table = swept
    assert not [name for name in table.columns if " " in name]


def test_a_stored_trial_is_repeated_exactly(swept, cli, tmp_path):
    folder, table = swept
    trial_id = table["trial_id"][0]
    again = cli("run", "--config", folder / trial_id, "-o", tmp_path, "--json")
    assert again.code == 0, again.stderr
    assert again.document["trial_id"] == trial_id
    first = json.loads((folder / trial_id / "result.json").read_text())
    for key in ("local", "reconstruction", "choice", "overridden", "config"):
        assert _timeless(again.document[key]) == _timeless(first[key])
    changed = cli("run", "--config", folder / trial_id / "config.yaml", "seed=9", "-o", tmp_path, "--json")
    assert changed.document["seed"] == 9
    assert changed.document["trial_id"] != trial_id


def test_a_stored_configuration_that_is_none_is_refused(cli, tmp_path):
    (tmp_path / "config.yaml").write_text("- a\n")
    finished = cli("run", "--config", tmp_path)
    assert finished.code == 2
    assert "holds no configuration" in finished.stderr


def test_the_best_command_of_tune_reproduces_the_best_trial(cli, tmp_path):
    fixed = ("object=duck", "hand.fingers=4", *QUICK)
    finished = cli(
        "tune", "index.k_e=interval(0.5,2)", *fixed, "-m", "local.q3", "-n", 2, "--jobs", 0,
        "-o", tmp_path / "tune", "--json",
    )  # fmt: skip
    assert finished.code == 0, finished.stderr
    words = shlex.split(finished.document["best"])
    assert words[:2] == ["graspbench", "run"]
    again = cli(*words[1:], "-o", tmp_path / "again", "--json")
    assert again.code == 0, again.stderr
    assert (tmp_path / "tune" / again.document["trial_id"]).is_dir()
    assert again.document["hand"]["fingers"] == 4
    assert again.document["local"]["q3"] == finished.document["rows"][0]["local.q3"]


@pytest.mark.parametrize("command", ["config", "run"])
def test_an_experiment_sets_every_key(cli, tmp_path, command):
    (tmp_path / "experiment").mkdir()
    text = "defaults: [override /execution: 'off', override /record: 'off', override /object: sphere]\n"
    text += "seed: 3\nsearch: {enabled: false}\nsurface: {meridians: 16, parallels: 15}\n"
    text += "camera: {width: 160, height: 120, fx: 150, fy: 150}\nstations: {inner: {count: 0}}\n"
    (tmp_path / "experiment" / "mine.yaml").write_text(text)
    place = ("--config-dir", tmp_path) + (("-o", tmp_path / "out") if command == "run" else ())
    for word in ("+experiment=mine", "experiment=mine"):
        finished = cli(command, word, "--json", *place)
        assert finished.code == 0, finished.stderr
        tree = finished.document if command == "config" else finished.document["config"]
        assert (tree["seed"], tree["surface"]["meridians"], tree["object"]["name"]) == (3, 16, "sphere")
        assert cli(command, word, "seed=4", "--json", *place).document["seed"] == 4


def test_the_experiment_of_table_3_1_is_a_grid(cli):
    finished = cli("sweep", "experiment=table_3_1", "--dry-run", "--json")
    assert finished.code == 0, finished.stderr
    cells = [row["overrides"] for row in finished.document]
    assert len(cells) == 4
    assert sum("object=bottle hand.fingers=4" in cell for cell in cells) == 2
    refused = cli("run", "experiment=table_3_1")
    assert refused.code == 2
    assert "graspbench sweep" in refused.stderr


@pytest.mark.parametrize("where", ["object.mesh", "object.folder", "scene.table"])
def test_a_changed_user_file_is_another_trial(cli, tmp_path, where):
    mesh, picture = tmp_path / "meshes" / "cup.stl", tmp_path / "cloth.png"
    mesh.parent.mkdir()

    def write(size: float) -> None:
        trimesh.creation.icosphere(3, size).export(mesh)
        import cv2

        cv2.imwrite(str(picture), np.full((8, 8, 3), int(2000 * size), np.uint8))

    named = {
        "object.mesh": (f"object.mesh={mesh}",),
        "object.folder": ("object=folder", f"object.folder={mesh.parent}", "object.id=cup"),
        "scene.table": ("object=sphere", f"scene.table={picture}"),
    }[where]
    ids = []
    for size in (0.03, 0.03, 0.04):
        write(size)
        finished = cli("sweep", *named, *QUICK, "--dry-run", "--json", "-o", tmp_path / "r")
        assert finished.code == 0, finished.stderr
        ids.append(finished.document[0]["trial"])
    assert ids[0] == ids[1] != ids[2]


def test_a_changed_hand_is_another_trial(cli, tmp_path):
    urdf, mesh = tmp_path / "hand.urdf", tmp_path / "meshes" / "link.stl"
    mesh.parent.mkdir()
    mesh.write_bytes(b"one")
    urdf.write_text(
        '<robot name="h"><link name="palm"><visual><geometry><mesh filename="package://meshes/link.stl"/>'
        "</geometry></visual></link></robot>"
    )

    def trial_id() -> str:
        finished = cli("sweep", f"hand.urdf={urdf}", "hand.kind=urdf", "--dry-run", "--json")
        assert finished.code == 0, finished.stderr
        return str(finished.document[0]["trial"])

    first = trial_id()
    assert trial_id() == first
    mesh.write_bytes(b"other")
    second = trial_id()
    urdf.write_text(urdf.read_text() + "<!-- changed -->")
    assert len({first, second, trial_id()}) == 3


def test_an_in_hand_motion_is_swept_like_any_trial(cli, tmp_path):
    folder = tmp_path / "r"
    finished = cli(
        "sweep", "object=sphere", "contact=hard,rolling", "motion=translate", "motion.duration_s=1",
        "clik.step_s=0.005", "clik.integrator=rk4", "search.enabled=false", *SMALL_PICTURES,
        "object.mesh=null,missing.stl", "record=off", "--jobs", 0, "-o", folder,
    )  # fmt: skip
    assert finished.code == 1
    table = pd.read_csv(folder / "trials.csv")
    assert sorted(table["status"]) == ["done", "done", "failed", "failed"]
    assert set(table["kind"]) == {"manipulation"}
    done = table[table["status"] == "done"]
    assert sorted(done["choice.contact"]) == ["hard", "rolling"]
    assert (done["manipulation.position_error_max_m"] < 1e-4).all()
    assert all(
        (folder / name / "error.txt").is_file() for name in table[table["status"] == "failed"]["trial_id"]
    )


def test_one_unreadable_result_blocks_nothing(cli, tmp_path):
    folder = tmp_path / "r"
    grid = ("sweep", "object=sphere", *QUICK, "--jobs", 0, "-o", folder)
    assert cli(*grid, "seed=0,1").code == 0
    broken = sorted(folder.glob("[!.]*/result.json"))[0]
    broken.write_text('{"schema": 3')
    again = cli(*grid, "seed=0,1,2")
    assert again.code == 1
    assert "unreadable" in again.stdout
    assert sorted(pd.read_csv(folder / "trials.csv")["status"]) == ["done", "done", "unreadable"]
    assert cli("report", folder, "--format", "csv,html").code == 0
    assert cli(*grid, "seed=0,1,2", "--retry-failed").code == 0
    assert set(pd.read_csv(folder / "trials.csv")["status"]) == {"done"}
