"""Appendix A through the real command line."""

import numpy as np
import pytest


@pytest.fixture(scope="module")
def appendix(process, tmp_path_factory):
    output = tmp_path_factory.mktemp("appendix")
    finished = process("paper", "appendix-a", "--json", "-o", output)
    assert finished.code == 0, finished.stderr
    return {row["object"]: row for row in finished.document["rows"]}, output


@pytest.mark.parametrize(
    ("name", "cei_deg", "eegi_deg"), [("keystone_prism", 9.9, 1.04), ("trilobe", 13.0, 2.2)]
)
def test_the_triangle_is_nearly_the_largest_and_errors_exceed_the_thesis_only_where_the_optimum_does(
    appendix, name, cei_deg, eegi_deg
):
    row = appendix[0][name]
    assert (row["phi_cei_deg"], row["phi_eegi_deg"], row["error_weight"]) == (15, 10, 0)
    assert row["cei_deg"] <= cei_deg or row["optimum_cei_deg"] > cei_deg
    assert row["eegi_deg"] <= eegi_deg or row["optimum_eegi_deg"] > eegi_deg
    # No triple of nodes with errors as small as the thesis' has a triangle as large.
    assert row["area_cm2"] >= row["area_at_thesis_errors_cm2"] > 0.0
    assert row["area_at_thesis_errors_cm2"] <= row["optimum_area_cm2"]
    assert 0.9 <= row["area_ratio"] <= 1.0 + 1e-9
    assert row["triples"] == row["nodes"] * (row["nodes"] - 1) * (row["nodes"] - 2) // 6


def test_two_fingers_on_corners_and_one_on_the_opposite_face(appendix):
    row = appendix[0]["keystone_prism"]
    normals = np.array(row["normals"])
    azimuths = np.sort(np.degrees(np.arctan2(normals[:, 1], normals[:, 0])))
    # The faces' normals are at -90, 26.6, 90 and 153.4 degrees; the lower corners lie between.
    left, right, top = azimuths
    assert -175 < left < -110
    assert -70 < right < 5
    assert top == pytest.approx(90, abs=12)


def test_figures_and_tables_are_there(appendix):
    output = appendix[1]
    files = {path.name for path in output.iterdir()}
    pictures = {f"figure_A_{n}.{kind}" for n in (1, 2) for kind in ("png", "pdf", "svg")}
    assert files == pictures | {"table.csv", "table.md", "table.tex", "result.json"}
    assert "keystone" in (output / "table.tex").read_text()


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("hand.fingers=2", "needs 3 fingers, not 2"),
        ("hand.fingers=4", "needs 3 fingers, not 4"),
        ("index=force_field", "about the index mirtich_canny, not force_field"),
    ],
)
def test_what_it_is_not_for(cli, tmp_path, override, message):
    finished = cli("paper", "appendix-a", override, "-o", tmp_path / "out")
    assert finished.code == 2
    assert message in finished.stderr
    assert not (tmp_path / "out").exists()
