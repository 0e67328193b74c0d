"""``graspbench bench reconstruction``, rough and on one object."""

import builtins
import csv

import cv2
import pytest


@pytest.fixture(scope="module")
def bench(cli, tmp_path_factory):
    """Run it without Open3D, whose carving alone takes seconds."""
    output = tmp_path_factory.mktemp("bench") / "deeper"
    original = builtins.__import__

    def without_open3d(name, *args, **kwargs):
        if name.partition(".")[0] == "open3d":
            raise ImportError(name)
        return original(name, *args, **kwargs)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(builtins, "__import__", without_open3d)
        arguments = ("bench", "reconstruction", "--objects", "sphere", "--quick", "--json", "-o", output)
        return cli(*arguments), output


def test_every_method_has_a_row_even_without_its_library(bench):
    finished, _ = bench
    assert finished.code == 0, finished.stderr
    rows = {row["method"]: row for row in finished.document["rows"]}
    assert len(rows) == 7
    missing = rows.pop("Open3D carve, 128^3")
    assert "not installed" in missing["note"]
    assert missing["time_ms"] is None
    assert rows["visual hull itself"]["time_ms"] is None
    for row in rows.values():
        assert row["object"] == "sphere"
        assert row["iou"] > 0.9
        assert row["hull_mean_mm"] < 0.5
        assert row["seen_hull_hausdorff_mm"] == max(
            row["surface_to_seen_hull_mm"], row["seen_hull_to_surface_mm"]
        )
    assert rows["elastic"]["node_hull_mean_mm"] < 0.12
    assert rows["elastic"]["time_ms"] > 0.0


def test_stages_cost_and_growth_are_in_tables_and_a_picture(bench):
    finished, output = bench
    document = finished.document
    assert document["stages"][0]["images"] == 13
    assert {row["over"] for row in document["cost"]} == {"nodes", "images"}
    assert [row["over"] for row in document["growth"]] == ["nodes", "images"]
    with (output / "reconstruction.csv").open(newline="") as stream:
        assert [row["method"] for row in csv.DictReader(stream)] == [r["method"] for r in document["rows"]]
    assert "### reconstruction: cost" in (output / "reconstruction.md").read_text()
    assert cv2.imread(document["figures"][0]).shape[1] == 1500
    assert not list(output.glob(".*"))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("nothing",), "unknown benchmark 'nothing'"),
        (("reconstruction", "--objects", "nothing"), "nothing"),
        (("reconstruction", "--objects", ","), "no object"),
        (("clik", "--objects", "teddy"), "--objects means nothing"),
    ],
)
def test_bad_input_is_told_before_anything_is_measured(cli, tmp_path, arguments, told):
    finished = cli("bench", *arguments, "-o", tmp_path / "out")
    assert finished.code == 2
    assert told in finished.stderr
    assert not (tmp_path / "out").exists()
