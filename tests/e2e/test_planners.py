"""Planners by the real command line: a study of several, and its leaderboard."""

import pytest

from graspbench.errors import ConfigurationError
from graspbench.experiment import load_config
from tests.small import SMALL_TRIAL

CHEAP = (*SMALL_TRIAL, "record=off")


@pytest.fixture(scope="module")
def study(cli, tmp_path_factory):
    folder = tmp_path_factory.mktemp("planners") / "study"
    planners = "planner=default,random_closure,eigengrasp,global_q1"
    finished = cli("sweep", "object=cylinder", planners, *CHEAP, "--jobs", "0", "-o", folder)
    return finished, folder


def test_a_sweep_over_planners_is_run_whole(study):
    finished, folder = study
    assert finished.code == 0, finished.stderr
    assert len(list(folder.glob("*/result.json"))) == 4


def test_its_report_begins_with_the_leaderboard(study, cli):
    _, folder = study
    finished = cli("report", folder, "--json")
    assert finished.code == 0, finished.stderr
    tables = finished.document["tables"]
    assert list(tables)[:2] == ["leaderboard", "planners"]
    rows = {row["planner"]: row for row in tables["leaderboard"]["rows"]}
    assert set(rows) == {"parallel", "random_closure", "eigengrasp", "global_q1"}
    for row in rows.values():
        assert row["found"] == 1.0
        assert row["q3"] > 0.0
        assert 0.0 < row["first_s"] <= row["best_s"]
    # What is searched for by Q1 has the largest Q1, but for the gap that is allowed.
    assert rows["global_q1"]["q1"] >= 0.98 * max(row["q1"] for row in rows.values()) - 1e-9
    report = folder / "report"
    assert {"leaderboard.md", "leaderboard.tex", "planners.csv", "index.html"} <= {
        path.name for path in report.iterdir()
    }


def test_an_unknown_planner_is_refused_with_the_ones_there_are(cli):
    finished = cli("config", "planner=eigengrap")
    assert finished.code == 2
    assert "eigengrasp" in finished.stderr


def test_the_thesis_experiments_refuse_a_planner_that_they_are_not_about(cli, tmp_path):
    finished = cli("paper", "table-3.1", "planner=random_closure", "--without", "hand", cwd=tmp_path)
    assert finished.code == 2
    assert "planner.restart" in finished.stderr
    with pytest.raises(ConfigurationError, match="the planner 'eigengrasp' is not the local one"):
        assert load_config(["planner=eigengrasp"]).local_planner


def test_grasps_are_collected_by_the_study_alone(cli):
    finished = cli("paper", "table-3.1", "--grasps", "5")
    assert finished.code == 2
    assert "collects no grasps" in finished.stderr
