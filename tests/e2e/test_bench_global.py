"""``graspbench bench global``, on a few nodes."""

import csv


def test_search_and_enumeration_agree_on_every_measure(cli, tmp_path):
    finished = cli("bench", "global", "--quick", "--objects", "duck", "--json", "-o", tmp_path)
    assert finished.code == 0, finished.stderr
    rows = finished.document["rows"]
    assert [(row["contacts"], row["measure"]) for row in rows] == [
        (3, "q1"), (3, "q2"), (3, "q3"), (3, "mirtich_canny"), (4, "q1"), (4, "q2"), (4, "q3"),
    ]  # fmt: skip
    for row in rows:
        assert row["agreement"], row
        assert row["optimal"], row
        assert row["ratio"] > 0.0
    assert any(row["value"] is not None for row in rows)
    with (tmp_path / "global.csv").open(newline="") as stream:
        assert len(list(csv.DictReader(stream))) == len(rows)
    assert "| ratio |" in (tmp_path / "global.md").read_text()


def test_no_object_is_told(cli, tmp_path):
    finished = cli("bench", "global", "--objects", ",", "-o", tmp_path / "out")
    assert finished.code == 2
    assert "no object" in finished.stderr
    assert not (tmp_path / "out").exists()
