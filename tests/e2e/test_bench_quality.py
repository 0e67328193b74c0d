"""``graspbench bench quality``, rough."""

import csv


def test_every_model_agrees_with_its_peers(cli, tmp_path):
    finished = cli("bench", "quality", "--quick", "--json", "-o", tmp_path)
    assert finished.code == 0, finished.stderr
    rows = finished.document["rows"]
    assert {row["contact"] for row in rows} == {"frictionless", "hard_finger", "soft_finger"}
    assert {row["measure"] for row in rows} == {"q1 and q2", "q3", "force closure"}
    for row in rows:
        assert row["largest_difference"] < 1e-9, row
        assert row["ratio"] > 0.0
    with (tmp_path / "quality.csv").open(newline="") as stream:
        assert len(list(csv.DictReader(stream))) == len(rows)
    assert "ratio" in (tmp_path / "quality.md").read_text()
