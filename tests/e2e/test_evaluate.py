"""``graspbench evaluate`` and ``graspbench export`` through the command line."""

import os

import numpy as np
import pandas as pd
import pytest

from tests.evaluation.scene import WRITERS, dexgraspbench, known, wxyz
from tests.small import SMALL_TRIAL

ALLEGRO = ("--hand", "allegro", "--object", "bottle")


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_in_each_format_is_judged(name, cli, tmp_path):
    write, file = WRITERS[name]
    path = write(tmp_path / file, known()[:3])
    finished = cli("evaluate", path, *ALLEGRO, "protocol=none", "--json")
    assert finished.code == 0, finished.stderr
    document = finished.document
    assert document["about"]["count"] == 3
    for row in document["rows"]:
        assert row["contacts"] >= 3
        assert row["depth_mm"] < 1.0
        assert row["measures"]["q1"] > 0.0
    closure = next(row for row in document["protocols"] if row["protocol"] == "force_closure")
    assert 0.0 <= closure["low"] <= closure["success"] <= closure["high"] <= 1.0


def test_protocols_their_table_and_ranks(cli, tmp_path):
    path = dexgraspbench(tmp_path / "g.npy", known()[:4])
    asked = ("protocol=six_forces,lift", "protocol.friction=0.8", "protocol.lift.mass_kg=0.1")
    finished = cli("evaluate", path, *ALLEGRO, *asked, "--json", "-o", tmp_path / "judged")
    assert finished.code == 0, finished.stderr
    document = finished.document
    assert document["about"]["protocols"]["lift"]["mass_kg"] == 0.1
    assert document["about"]["protocols"]["six_forces"]["friction"] == 0.8
    for name in ("six_forces", "lift"):
        row = next(row for row in document["protocols"] if row["protocol"] == name)
        outcomes = [each["protocols"][name]["success"] for each in document["rows"]]
        assert row["success"] == pytest.approx(np.mean(outcomes))
        assert row["grasps"] == 4
    assert document["ranks"][0]["first"] == "six_forces"
    table = pd.read_csv(tmp_path / "judged/grasps.csv")
    assert table["protocols.lift.success"].tolist() == [
        row["protocols"]["lift"]["success"] for row in document["rows"]
    ]
    assert (tmp_path / "judged/evaluation.json").is_file()


def test_a_planted_fault_is_refused_and_can_be_read_as_meant(cli, tmp_path):
    def last(transform):
        w, *xyz = wxyz(transform)
        return [*xyz, w]

    path = dexgraspbench(tmp_path / "g.npy", known(), quaternion=last)
    refused = cli("evaluate", path, *ALLEGRO, "protocol=none")
    assert refused.code == 2
    assert "quaternions as xyzw instead of wxyz" in refused.stderr
    assert "--read-as xyzw" in refused.stderr
    assert refused.stderr.count("\n") == 1
    assert cli("evaluate", path, *ALLEGRO, "protocol=none", "--read-as", "xyzw").code == 0
    assert cli("evaluate", path, *ALLEGRO, "protocol=none", "--as-it-is").code == 0


def test_two_processes_say_what_one_says(cli, tmp_path):
    path = dexgraspbench(tmp_path / "g.npy", known() * 3)
    common = ("evaluate", path, *ALLEGRO, "protocol=none", "--json")
    alone, both = cli(*common), cli(*common, "--jobs", "2")
    assert both.code == 0, both.stderr
    assert [row["grasp"] for row in both.document["rows"]] == list(range(24))
    assert both.document == alone.document


class Malicious:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.system, (f"touch {self.path}",)


def test_a_malicious_file_is_refused_in_a_sentence(cli, tmp_path):
    bad = {"grasp_qpos": Malicious(tmp_path / "touched")}
    np.save(tmp_path / "bad.npy", np.array(bad, dtype=object), allow_pickle=True)
    finished = cli("evaluate", tmp_path / "bad.npy", *ALLEGRO)
    assert finished.code == 2
    assert "holds code" in finished.stderr
    assert finished.stderr.count("\n") == 1
    assert not (tmp_path / "touched").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("missing.npy", *ALLEGRO), "no file missing.npy"),
        (("missing", "protocol=all"), "no file or results folder missing"),
        (("g.npy", "--hand", "allegro"), "no object is given"),
        (("g.npy", *ALLEGRO, "protocol=beauty"), "unknown protocol 'beauty'"),
        (("g.npy", *ALLEGRO, "protocol.beauty=1"), "beauty"),
        (("g.npy", *ALLEGRO, "protocol.mass_kg=-1"), "mass_kg"),
        (("g.npy", *ALLEGRO, "--format", "csv"), "grasp_format 'csv'"),
        (("g.npy", *ALLEGRO, "--read-as", "inches"), "inches"),
        (("g.npy", "--hand", "radial", "--object", "bottle"), "takes 7 +"),
    ],
)
def test_what_cannot_be_used_is_said(arguments, words, cli, tmp_path):
    dexgraspbench(tmp_path / "g.npy", known()[:1])
    finished = cli("evaluate", *arguments, cwd=tmp_path)
    assert finished.code == 2
    assert words in finished.stderr


CHEAP = (*SMALL_TRIAL, "record=off")


@pytest.fixture(scope="module")
def results(cli, tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    finished = cli("run", "object=cylinder", "hand=radial", *CHEAP, "-o", folder, "--json")
    assert finished.code == 0, finished.stderr
    return folder, finished.document


@pytest.mark.parametrize("name", ["jsonl", "parquet", "isaac", "dexgraspbench", "dexgraspnet"])
def test_a_planned_grasp_is_exported_and_comes_back(name, cli, results, tmp_path):
    folder, document = results
    suffix = {"jsonl": "jsonl", "parquet": "parquet", "isaac": "yaml"}.get(name, "npy")
    target = tmp_path / f"g.{suffix}"
    written = cli("export", folder, "--format", name, "-o", target, "--json")
    assert written.code == 0, written.stderr
    assert written.document["rows"][0]["grasps"] == 1
    judged = cli("evaluate", target, "--hand", "radial", "--object", "cylinder", "protocol=none", "--json")
    assert judged.code == 0, judged.stderr
    row = judged.document["rows"][0]
    # The surface that it was planned on is a coarse reconstruction of the object that it is judged on.
    assert row["contacts"] >= document["hand"]["fingers"] - 1
    assert row["fingers"] >= 2


def test_nothing_to_export_is_said(cli, results, tmp_path):
    folder, _ = results
    refused = cli("export", folder, "--which", "restarted", "-o", tmp_path / "g.jsonl")
    assert refused.code == 2
    assert "none of the trials has a grasp" in refused.stderr
    assert not (tmp_path / "g.jsonl").exists()
    assert cli("export", folder, "--format", "csv").code == 2


def test_planners_of_a_sweep_are_compared_by_every_protocol_and_gone_on_with(cli, tmp_path):
    planned = cli(
        "sweep", "object=cylinder", "planner=default,random_closure", *CHEAP, "-o", tmp_path / "planned"
    )
    assert planned.code == 0, planned.stderr
    asked = ("evaluate", tmp_path / "planned", "protocol=six_forces,tug", "-o", tmp_path / "judged", "--json")
    first = cli(*asked)
    assert first.code == 0, first.stderr
    document = first.document
    assert [row["planner"] for row in document["planners"]] == ["parallel", "random_closure"]
    assert {row["planner"] for row in document["rows"]} == {"parallel", "random_closure"}
    for row in document["planners"]:
        own = [each for each in document["rows"] if each["planner"] == row["planner"]]
        assert row["trials"] == len(own) == 1
        assert row["tug"] == float(own[0]["protocols"]["tug"]["success"])
    (rank,) = document["ranks"]
    assert (rank["first"], rank["second"]) == ("six_forces", "tug")
    assert pd.read_csv(tmp_path / "judged/planners.csv")["planner"].tolist() == ["parallel", "random_closure"]
    kept = (tmp_path / "judged/rows.jsonl").read_text()
    assert cli(*asked).document == document
    assert (tmp_path / "judged/rows.jsonl").read_text() == kept
    (tmp_path / "judged/rows.jsonl").write_text("".join(kept.splitlines(keepends=True)[:-1]))
    assert cli(*asked, "--jobs", "2").document == document, "a row that was lost is made anew as it was"
    other = cli(*asked, "protocol.mass_kg=0.2")
    assert other.code == 2
    assert "made with other options" in other.stderr
    hand = cli(*asked, "object=duck")
    assert hand.code == 2
    assert "the trials' to say" in hand.stderr
