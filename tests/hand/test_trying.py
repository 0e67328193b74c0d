from graspbench.experiment import load_config
from graspbench.hand import load_hand
from graspbench.hand.importing.trying import is_better_with_two, reasons_around
from graspbench.hand.posture_search import CLAUSES, OBJECT


def radial(fingers, **changes):
    options = [f"hand.{key}={value}" for key, value in changes.items()]
    return load_hand(load_config(["hand=radial", f"hand.fingers={fingers}", *options]).hand)


def test_a_round_hand_reaches_around_bodies_of_its_size_only():
    assert not any(reasons_around(radial(3), 0.06))
    assert all(reasons_around(radial(3), 0.9))


def test_a_hand_is_better_with_two_fingers_where_three_reach_no_body():
    assert not is_better_with_two(radial(3), radial(2), 0.06)
    assert is_better_with_two(radial(3), radial(2), 0.9)


def test_a_hand_whose_links_lean_into_every_body_is_better_with_two_that_do_not():
    wary = radial(3, **{"margins.object_m": 0.02})
    assert set(reasons_around(wary, 0.06)) == {CLAUSES[OBJECT]}
    assert is_better_with_two(wary, radial(2), 0.06)
    assert not is_better_with_two(wary, radial(2, **{"margins.object_m": 0.02}), 0.06)
