"""`graspbench sweep` and `graspbench report`."""

import pandas as pd
import pytest

from tests.small import SMALL_PICTURES


@pytest.fixture(scope="module")
def swept(cli, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep") / "grid"
    quick = ("record=off", "execution=off", "search.measures=[q1]", "search.refine=false", *SMALL_PICTURES)
    arguments = ("sweep", "object=teddy,bottle", "index.k_cm=0,1", *quick, "-o", folder)
    return cli(*arguments), folder, arguments


def test_dry_run_shows_the_grid_and_writes_nothing(cli, tmp_path):
    finished = cli(
        "sweep", "object=teddy,duck", "seed=range(0,3)", "--dry-run", "--json", "-o", tmp_path / "x"
    )
    assert finished.code == 0
    assert len({row["trial"] for row in finished.document}) == 6
    assert not (tmp_path / "x").exists()


def test_grid_is_run_and_every_trial_is_in_the_table(swept):
    finished, folder, _ = swept
    assert finished.code == 0, finished.stderr
    table = pd.read_csv(folder / "trials.csv")
    assert len(table) == 4
    assert set(table["object.name"]) == {"teddy", "bottle"}
    assert set(table["index.k_cm"]) == {0.0, 1.0}
    assert (table["status"] == "done").all()
    assert (table["ratio.q1"] > 0).all()


def test_finished_trials_are_not_run_again(swept, cli):
    _, folder, arguments = swept
    before = {path: path.stat().st_mtime_ns for path in folder.glob("*/result.json")}
    finished = cli(*arguments)
    assert finished.code == 0
    assert "0 to run" in finished.stderr
    assert {path: path.stat().st_mtime_ns for path in folder.glob("*/result.json")} == before


def test_report_in_three_formats(swept, cli):
    _, folder, _ = swept
    finished = cli("report", folder, "--format", "markdown,latex,csv")
    assert finished.code == 0, finished.stderr
    report = folder / "report"
    assert {"table.csv", "table.md", "table.tex"} <= {path.name for path in report.iterdir()}
    assert "\\toprule" in (report / "table.tex").read_text()
    assert "teddy" in (report / "table.md").read_text()
    assert len(pd.read_csv(report / "table.csv")) == 4


def test_one_failing_trial_leaves_the_others_alone(cli, tmp_path):
    folder = tmp_path / "r"
    grid = (
        "object=cylinder",
        "object.mesh=null,missing.stl",
        "experiment=quick",
        "record=off",
        *SMALL_PICTURES,
    )
    finished = cli("sweep", *grid, "-o", folder, "--jobs", "0")
    assert finished.code == 1
    table = pd.read_csv(folder / "trials.csv").set_index("status")
    assert sorted(table.index) == ["done", "failed"]
    assert "missing.stl" in table.loc["failed", "reason"]


def test_report_of_nothing_is_one_sentence(cli, tmp_path):
    finished = cli("report", tmp_path / "absent")
    assert finished.code == 2
    assert "absent" in finished.stderr
    assert "Traceback" not in finished.stderr
