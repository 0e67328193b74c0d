"""Touches before the grasp make good an error of pose that vision had, through the real command line."""

import pytest

CHEAP = (
    "object=box", "search.enabled=false", "record.pictures=false", "execution=touch",
    "execution.until=contact", "scene.unseen_shift_mm=5", "scene.unseen_turn_deg=10",
)  # fmt: skip


def test_five_touches_make_good_a_shift_that_was_not_seen(cli, tmp_path):
    finished = cli("run", *CHEAP, "-o", tmp_path, "--json")
    assert finished.code == 0, finished.stderr
    found = finished.document["execution"]["touch"]
    assert found["pose_error_before_mm"] == pytest.approx(5.0, abs=0.2)
    assert found["turn_error_before_deg"] == pytest.approx(10.0, abs=0.2)
    assert 1 <= found["touches"] <= found["tried"] <= 5
    assert found["pose_error_after_mm"] < 2.5
    assert found["turn_error_after_deg"] < 5.0
    assert found["expected_after_mm"] < found["expected_before_mm"]
    assert finished.document["execution"]["true_q3"] > 0.0


def test_of_a_few_exploring_grasps_the_one_that_feels_best_is_executed(cli, tmp_path):
    finished = cli(
        "run", "object=box", "search.enabled=false", "record.pictures=false", "execution=explore",
        "execution.touch.max_grasps=3", "execution.until=contact", "-o", tmp_path, "--json",
    )  # fmt: skip
    assert finished.code == 0, finished.stderr
    found = finished.document["explored"]
    assert found["grasps"] == len(found["felt"]) == len(found["foreseen"]) <= 3
    assert found["value"] == max(found["felt"]) == found["felt"][found["best"]]
    assert found["first"] == found["felt"][0]
    assert found["foreseen"][0] == pytest.approx(finished.document["local"]["q3"], rel=1e-6)
    assert found["verified"] is True
    assert found["moved_mm"] < 2.0
    # What is executed is what felt best, so the contacts are as good again.
    assert finished.document["execution"]["true_q3"] == pytest.approx(found["value"], rel=0.3)


@pytest.mark.parametrize(
    ("overrides", "what"),
    [
        (("execution=explore", "execution.touch.max_touches=2"), "max_touches exclude each other"),
        (
            ("execution=explore", "scene.motion=drift", "scene.unseen_shift_mm=0", "scene.unseen_turn_deg=0"),
            "scene.motion exclude each other",
        ),
        (("execution.touch.max_touches=-1",), "execution.touch.max_touches"),
        (("scene.motion=drift",), "unseen shift"),
        (("scene=images", "scene.images_dir=photos"), "images from files"),
    ],
)
def test_what_cannot_be_shifted_or_felt_is_refused_in_a_sentence(cli, tmp_path, overrides, what):
    finished = cli("run", *CHEAP, *overrides, "-o", tmp_path)
    assert finished.code == 2
    assert what in finished.stderr
