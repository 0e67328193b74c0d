"""Figures 3.3, 3.5, 3.10 and 3.11 through the real command line."""

import cv2
import numpy as np
import pytest

from graspbench.paper.figures_3 import thesis_rows


@pytest.fixture(scope="module")
def cylinder(cli, tmp_path_factory):
    output = tmp_path_factory.mktemp("figures") / "out"
    finished = cli(
        "paper", "figures-3", "object=cylinder", "surface.nodes=600", "--forces", "--json", "-o", output
    )  # fmt: skip
    assert finished.code == 0, finished.stderr
    return finished.document["rows"], output


def test_every_figure_and_table_is_there(cylinder):
    names = {path.name for path in cylinder[1].iterdir() if path.suffix not in (".pdf", ".svg")}
    vectors = {path.name for path in cylinder[1].iterdir()} - names
    by_gain = {
        f"{kind}_cylinder_k_cm_{k}.png" for kind in ("figure_3_10", "figure_3_11", "forces") for k in (0, 1)
    }
    assert names == by_gain | {
        "figure_3_3_cylinder.png",
        "figure_3_5_cylinder.png",
        "table.csv",
        "table.md",
        "table.tex",
        "result.json",
    }
    drawn = [path.stem for path in cylinder[1].glob("*.png")]
    assert vectors == {f"{stem}{suffix}" for stem in drawn for suffix in (".pdf", ".svg")}
    for name in by_gain:
        image = cv2.imread(str(cylinder[1] / name))
        assert image.shape[1] > 1000
        assert (image < 200).any(axis=-1).mean() > 0.01


def test_rows_describe_the_grasps(cylinder):
    with_pull, without = cylinder[0]
    assert (with_pull["k_cm"], without["k_cm"]) == (1, 0)
    for row in cylinder[0]:
        assert row["equilateral_error_deg"] <= 8.0
        assert row["area_cm2"] > 1.0
    assert with_pull["plane_offset_mm"] <= 2.5


def test_forces_are_the_sum_of_their_terms(cylinder):
    for row in cylinder[0]:
        forces = {name: np.array(values) for name, values in row["forces_n"].items()}
        total = sum(forces[name] for name in ("plane", "centroid", "equilateral", "area", "barrier"))
        assert forces["projected"].shape == (3, 3)
        # The projection takes away a part along the normal only.
        assert np.all(np.linalg.norm(forces["projected"], axis=1) <= np.linalg.norm(total, axis=1) + 1e-12)
        if row["k_cm"] == 0:
            assert not forces["centroid"].any()
        np.testing.assert_allclose(np.linalg.norm(forces["area"], axis=1), 1.0)
        assert len(row["barrier_n"]["joint"]) == 3


def test_forces_are_asked_of_the_force_field_only(cli, tmp_path):
    finished = cli("paper", "figures-3", "index=quality_ascent", "--forces", "-o", tmp_path / "out")
    assert finished.code == 2
    assert "no force field" in finished.stderr
    finished = cli("paper", "appendix-a", "--forces", "-o", tmp_path / "out")
    assert finished.code == 2
    assert "draws no forces" in finished.stderr
    assert not (tmp_path / "out").exists()


def test_the_thesis_grasps_are_equilateral_and_off_the_centroid_without_the_pull():
    # The teddy has many optima of nearly equal worth, so that a column of pixels more can decide between
    # them. Seen: offsets of 8.2 mm in all with the pull and 24.3 mm without it, angles off by 2 to 13 deg.
    rows = {(row["object"], row["k_cm"]): row for row in thesis_rows(())}
    assert set(rows) == {("teddy", 1), ("teddy", 0), ("bottle", 1), ("bottle", 0)}
    offsets = {k: sum(rows[name, k]["plane_offset_mm"] for name in ("teddy", "bottle")) for k in (0, 1)}
    assert offsets[1] <= 10.0
    assert offsets[0] > 1.25 * offsets[1]
    errors = [row["equilateral_error_deg"] for row in rows.values()]
    assert max(errors) <= 30.0
    assert sum(errors) / len(errors) <= 15.0
