"""Which columns of trials say what was asked for, and which what came of it."""

import pandas as pd
import pytest

from graspbench.report import columns as c
from graspbench.report.heads import head_of, smaller_is_better
from graspbench.report.notes import status_notes, success_notes, version_notes


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("choice.surface", True),
        ("camera.width", True),
        ("seed", True),
        ("index.k_cm", True),
        ("local.q1", False),
        ("times_s.images", False),
        ("provenance.host", False),
        ("choice.record", False),
        ("execution.largest_push_weight", False),
        ("execution.friction", False),
        ("quality.friction", True),
        ("execution.phases.lift.slip_m", False),
    ],
)
def test_settings_are_told_from_outcomes(name, expected):
    assert c.is_setting(name) is expected


def test_differing_settings_are_named_once_a_section_and_the_seed_last():
    trials = pd.DataFrame(
        {
            "seed": [0, 1, 0, 1],
            "index.name": ["a", "a", "b", "b"],
            "index.k_e": [1.0, 1.0, None, None],
            "choice.index": ["a", "a", "b", "b"],
            "choice.surface": ["thesis", "smooth", "thesis", "smooth"],
            "camera.width": [320, 320, 320, 640],
            "local.q1": [1, 2, 3, 4],
        }
    )
    assert c.differing(trials) == ["index.name", "choice.surface", "camera.width", "seed"]
    assert c.differing(trials, ["index.name", "choice.surface"]) == []
    assert c.differing(trials, ["choice.surface"]) == ["index.name", "camera.width"]


def test_success_is_a_number_where_it_is_known():
    values = c.numbers(pd.DataFrame({"success": pd.Series([True, None, False], dtype=object)}), "success")
    assert values.tolist()[::2] == [1.0, 0.0]
    assert values.isna().tolist() == [False, True, False]
    assert c.numbers(pd.DataFrame({"a": [1, 2]}), "b").isna().all()


def test_notes_count_what_is_left_out_and_name_mixed_code():
    trials = pd.DataFrame(
        {
            "status": ["done", "failed", "unreadable"],
            "success": [True, None, None],
            "provenance.graspbench": ["0.1.0", "0.2.0", None],
            "provenance.git.commit": ["a" * 40, "a" * 40, None],
        }
    )
    assert status_notes(trials) == ("Of 3 trials 1 failed, 1 unreadable: not in the means.",)
    assert "2 of 3" in success_notes(trials)[0]
    assert version_notes(trials) == ("Mixes results of different code: versions 0.1.0, 0.2.0.",)
    assert status_notes(trials[:1]) == success_notes(trials[:1]) == version_notes(trials[:1]) == ()


@pytest.mark.parametrize(
    ("name", "head"),
    [
        ("ratio.q1", ("Q1 local / global", "")),
        ("local.q2", ("Q2 local", "")),
        ("global.q3.time_s", ("Q3 global time", "s")),
        ("local.time_s", ("planning time", "s")),
        ("execution.phases.lift.slip_m", ("slip in lift", "m")),
        ("index.k_cm", ("k_cm", "")),
        ("camera.width", ("camera width", "")),
        ("choice.surface", ("surface", "")),
        ("times_s.images", ("time of images", "s")),
        ("seed", ("seed", "")),
    ],
)
def test_headings_are_what_a_reader_knows(name, head):
    assert head_of(name) == head


def test_less_time_and_less_slip_are_better():
    assert smaller_is_better("local.time_s")
    assert smaller_is_better("execution.phases.lift.slip_m")
    assert not smaller_is_better("ratio.q1")
