"""Table 3.1 through the real command line, on one object with few nodes."""

import csv
import json

import pytest

ARGUMENTS = (
    "paper", "table-3.1", "object=teddy", "surface.nodes=150", "index.k_cm=1", "search.measures=[q1,q2]",
    "planner.refine.jumps=1", "planner.refine.draws=50", "--jobs", "0", "--json",
)  # fmt: skip


@pytest.fixture(scope="module")
def table(cli, tmp_path_factory):
    output = tmp_path_factory.mktemp("table") / "deeper"
    return cli(*ARGUMENTS, "-o", output), output


def test_each_measure_has_its_certified_optimum_and_the_thesis_ratio(table):
    finished, _ = table
    assert finished.code == 0, finished.stderr
    rows = {row["measure"]: row for row in finished.document["rows"]}
    assert set(rows) == {"Q1", "Q2"}
    for row in rows.values():
        assert row["optimal"]
        assert 0.0 < row["local"] <= row["refined"] <= row["global"] * (1.0 + 1e-9)
        assert row["ratio"] == pytest.approx(row["local"] / row["global"])
        assert row["met"] == ("yes" if row["ratio"] >= row["thesis"] else "no")
        assert row["serial_s"] == pytest.approx(row["reconstruction_s"] + row["search_s"])
    assert rows["Q1"]["thesis"] == pytest.approx(0.292 / 0.320)


def test_short_cells_are_explained_and_drawn(table):
    finished, output = table
    for row in finished.document["rows"]:
        short = row["met"] == "no" or row["ratio_refined"] < 0.97
        assert (row["picture"] is not None) == short
        if short:
            assert (output / row["picture"]).is_file()
            assert "mm wide" in row["reason"]
            assert row["reason"] in (output / "short.md").read_text()


def test_files_are_complete_and_a_second_run_computes_nothing(table, cli):
    finished, output = table
    assert {"table.csv", "table.md", "table.tex", "ratios.png", "result.json", "short.md", "trials.csv"} <= {
        path.name for path in output.iterdir()
    }
    with (output / "table.csv").open(newline="") as stream:
        assert [row["measure"] for row in csv.DictReader(stream)] == ["Q1", "Q2"]
    (trial,) = output.glob("[!.]*/result.json")
    before = trial.stat().st_mtime_ns
    again = cli(*ARGUMENTS, "-o", output)
    assert trial.stat().st_mtime_ns == before
    assert again.document == finished.document
    assert json.loads((output / "result.json").read_text())["rows"] == finished.document["rows"]


def test_bad_input_leaves_nothing(cli, tmp_path):
    finished = cli("paper", "table-3.1", "object=nothing", "-o", tmp_path / "out")
    assert finished.code == 2
    assert "nothing" in finished.stderr
    assert not (tmp_path / "out").exists()


def test_without_the_hand_contacts_may_be_anywhere(cli, tmp_path, table):
    quick = (
        "planner.restart=false",
        "search.refine=false",
        "search.measures=[q1]",
        "search.centre_tolerance_m=0.05",
    )
    finished = cli(*ARGUMENTS, *quick, "--without", "hand", "-o", tmp_path / "out")
    assert finished.code == 0, finished.stderr
    (free,) = finished.document["rows"]
    held = {row["measure"]: row for row in table[0].document["rows"]}["Q1"]
    assert free["optimal"]
    assert free["global"] >= held["global"] * (1.0 - 1e-9)
    assert free["ratio"] == pytest.approx(free["local"] / free["global"])
    with (tmp_path / "out" / "table.csv").open(newline="") as stream:
        (row,) = csv.DictReader(stream)
    assert (row["without"], row["contact"], row["wrench_space"], row["friction"], row["torque_length"]) == (
        "hand", "hard_finger", "spatial", "0.5", "auto",
    )  # fmt: skip
    assert "Without a hand" in (tmp_path / "out" / "table.md").read_text()


def test_only_the_table_is_compared_without_a_hand(cli, tmp_path):
    finished = cli("paper", "appendix-a", "--without", "hand", "-o", tmp_path / "out")
    assert finished.code == 2
    assert "use --without with table-3.1" in finished.stderr
