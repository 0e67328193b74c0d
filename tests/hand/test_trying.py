from graspbench.experiment import load_config
from graspbench.hand import load_hand
from graspbench.hand.importing.trying import reached_share


def test_a_round_hand_reaches_around_bodies_of_its_size_only():
    hand = load_hand(load_config(["hand=radial"]).hand)
    assert reached_share(hand, 0.06) == 1.0
    assert reached_share(hand, 0.9) == 0.0
