"""Every measure that the global search knows, through a whole trial."""

import pytest

from graspbench.planning.global_search import GLOBAL_MEASURES
from tests.small import SMALL_PICTURES

QUICK = (
    "object=ellipsoid", "surface.nodes=150", "planner.planes=2", "planner.candidates=1", "execution=off",
    "record=off", "search.time_limit_s=2", *SMALL_PICTURES,
)  # fmt: skip


def test_a_trial_searches_every_measure_there_is(cli, tmp_path):
    measures = ",".join(GLOBAL_MEASURES)
    finished = cli(
        "run",
        *QUICK,
        f"search.measures=[{measures}]",
        "search.refine=true",
        "--output",
        tmp_path,
        "--json",
    )
    assert finished.code == 0, finished.stderr
    result = finished.document
    assert set(result["global"]) == set(GLOBAL_MEASURES)
    assert set(result["refined"]) == {"q1", "q2", "q3"}
    for measure, ratio in result["ratio"].items():
        assert ratio == pytest.approx(result["local"][measure] / result["global"][measure]["value"])
        assert 0.0 < ratio <= 1.0 + 1e-9
    triangle = result["local"]["mirtich_canny"]
    assert ("mirtich_canny" in result["ratio"]) == (triangle is not None)


def test_a_measure_that_cannot_be_searched_is_refused_before_anything_runs(cli):
    unknown = cli("config", "search.measures=[q1,q9]")
    assert unknown.code == 2
    assert "q9" in unknown.stderr
    fingers = cli("config", "search.measures=[q1,mirtich_canny]", "hand.fingers=4")
    assert fingers.code == 2
    assert "it is defined for 3 fingers" in fingers.stderr
