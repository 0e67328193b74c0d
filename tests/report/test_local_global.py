"""Rows, sentences, tables and pictures of the comparison of local and global grasps."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from graspbench.grasp import Grasp
from graspbench.report.local_global import (
    comparison_rows,
    contact_distance_m,
    is_short,
    local_global_table,
    reason,
    summary,
)
from graspbench.report.local_global_figures import draw_grasps, draw_ratios
from graspbench.report.tables import table_files
from graspbench.results.grasp_results import ContactResult, RefinedGraspResult
from graspbench.results.trial_result import ObjectResult
from tests.planning.shapes import ellipsoid
from tests.report.made import GLOBAL, LOCAL, made_result

TRIANGLE = 0.03 * np.array([[np.cos(a), np.sin(a), 0.0] for a in np.radians([90.0, 210.0, 330.0])])


def _contacts(points):
    contacts = tuple(ContactResult(k, tuple(point), (0.0, 0.0, 1.0)) for k, point in enumerate(points))
    return {"contacts": contacts, "centroid": (0.0, 0.0, 0.0)}


def _result(*, name="teddy", gain=1.0, ratio=0.8, refined=0.99, optimal=True):
    wide = TRIANGLE * [1.0, 2.0, 1.0] + [0.0, 0.0, 0.005]
    certificate = {"upper_bound": 2.2, "gap": 0.0 if optimal else 0.1, "optimal": optimal, "time_s": 1.9}
    certificate |= {"upper_bound_up_to_solver": 2.0, "doubtful": 0 if optimal else 7}
    local = replace(LOCAL, q2=2.0 * ratio, reconstruction_time_s=0.1, time_s=0.2, **_contacts(TRIANGLE))
    climbed = RefinedGraspResult(
        start_value=2.0 * ratio, value=2.0 * refined, steps=1, evaluated=1, placements=1, time_s=0.1,
        **_contacts(wide[::-1]),
    )  # fmt: skip
    return made_result(
        "0123456789",
        object=ObjectResult(name),
        index={"name": "force_field", "k_cm": gain},
        local=local,
        global_={"q2": replace(GLOBAL, value=2.0, **certificate, **_contacts(wide))},
        refined={"q2": climbed},
    )


def test_a_row_holds_ratios_times_and_the_thesis_ratio():
    (row,) = comparison_rows(_result(ratio=0.8))
    assert row["ratio"] == pytest.approx(0.8)
    assert row["ratio_refined"] == pytest.approx(0.99)
    assert row["thesis"] == pytest.approx(0.536 / 0.690)
    assert row["met"] == "yes"
    assert row["serial_s"] == pytest.approx(2.0)
    assert row["speedup"] == pytest.approx(10.0)
    assert not is_short(row)


@pytest.mark.parametrize(
    ("change", "met", "short"),
    [
        ({"ratio": 0.77}, "no", True),
        ({"gain": 0.0, "ratio": 0.88}, "no", True),
        ({"refined": 0.96}, "yes", True),
        ({"name": "duck", "ratio": 0.1}, None, False),
        ({"gain": 0.5, "ratio": 0.1}, None, False),
    ],
)
def test_short_is_below_the_thesis_or_badly_refined(change, met, short):
    (row,) = comparison_rows(_result(**change))
    assert row["met"] == met
    assert is_short(row) == short


def test_a_failed_trial_has_no_rows():
    assert comparison_rows(made_result("0123456789", status="failed", local=None, global_={})) == []


def test_contacts_are_matched_whatever_their_order():
    moved = TRIANGLE + np.array([0.0, 0.0, 0.004])
    for turn in range(3):
        assert contact_distance_m(TRIANGLE, np.roll(moved, turn, axis=0)) == pytest.approx(0.004)


def test_the_sentence_says_how_the_grasps_differ():
    result = _result(refined=0.9, optimal=False)
    (row,) = comparison_rows(result)
    text = reason(row, result, 0.15)
    width = 1e3 * np.hypot(0.03 * np.sqrt(3) / 2, 2 * 0.045)
    assert f"{width:.0f} mm wide (local 52; the hand spans 150)" in text
    assert "5.0 mm from the centroid (local 0.0)" in text
    assert "equilateral (local 0," in text
    assert "0 mm a contact from the global one" in text
    assert "within 10.0 % only: 7 better grasps were refused by the posture solver, no proof." in text


def test_tables_hold_every_row_and_what_they_say_in_all():
    rows = [*comparison_rows(_result()), *comparison_rows(_result(gain=0.0, refined=0.9))]
    assert summary(rows)["thesis_cells_met"] == 1
    assert summary(rows)["refined_cells_met"] == 1
    tables = table_files(local_global_table(rows, ["A note with k_cm."]))
    assert set(tables) == {"table.csv", "table.md", "table.tex"}
    assert tables["table.csv"].count("teddy") == 2
    assert "1 of 2 cells" in tables["table.md"]
    assert r"\toprule" in tables["table.tex"]
    assert "A note with $k_{cm}$." in tables["table.tex"]


def test_pictures_show_ratios_and_grasps(tmp_path):
    rows = [*comparison_rows(_result()), *comparison_rows(_result(name="duck"))]
    ratios = cv2.imread(str(draw_ratios(rows, tmp_path / "ratios.png")))
    assert (ratios < 128).any()
    surface = ellipsoid((0.03, 0.025, 0.04), meridians=8, parallels=7)
    nodes = np.array([10, 20, 30])
    grasp = Grasp(nodes, surface.points[nodes], surface.normals[nodes], surface.centroid, None)
    one = cv2.imread(str(draw_grasps(surface, {"local": grasp}, tmp_path / "a.png", "title", "caption")))
    two = draw_grasps(surface, {"local": grasp, "global": grasp}, tmp_path / "b.png", "title", "a " * 99)
    assert cv2.imread(str(two)).shape[1] == 2 * one.shape[1]
