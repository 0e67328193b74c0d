"""`graspbench manipulate contact.sliding...` as a user meets it."""

import numpy as np
import pandas as pd
import pytest

SHORT = ("clik.step_s=0.005", "motion.duration_s=2", "record.pictures=false")
SLIDE = ("object=sphere", "hand.fingers=4", "motion=hold", "contact.sliding.fingers=[0]", *SHORT)


def test_a_finger_slides_over_a_sphere(cli, tmp_path):
    finished = cli("manipulate", *SLIDE, "contact.sliding.way_m=[0,0,0.005]", "--json", "-o", tmp_path)
    assert finished.code == 0, finished.stderr
    result = finished.document
    assert (result["status"], result["success"]) == ("done", True)
    found = result["sliding"]
    assert found["verified"]
    assert found["violations"] == []
    assert 0.002 < found["slid_max_m"] < 0.02
    assert found["stuck_slip_max_m"] <= 1e-5
    assert found["reserve_min"] >= 0.05 - 1e-4
    table = pd.read_csv(tmp_path / result["trial_id"] / "sliding.csv")
    forces = table[[f"force_0_{axis}_n" for axis in "xyz"]].to_numpy()
    slips = table[[f"slip_0_{axis}_m_s" for axis in "xyz"]].to_numpy()
    speeds = np.linalg.norm(slips, axis=1)
    going = speeds > 1e-4
    assert going.sum() > 50
    # Coulomb: force along the slip is mu / sqrt(1 + mu^2) of the whole force
    along = np.einsum("ti,ti->t", forces, slips)[going] / speeds[going]
    share = along / np.linalg.norm(forces[going], axis=1)
    np.testing.assert_allclose(share, 0.5 / np.sqrt(1.25), rtol=1e-5)
    assert table.loc[going, "margin_0_n"].abs().max() == 0.0
    assert min(table[f"margin_{i}_n"].min() for i in (1, 2, 3)) > 0.0
    # the whole of the forces is the weight, always
    whole = sum(table[[f"force_{i}_{axis}_n" for axis in "xyz"]].to_numpy() for i in range(4))
    assert np.ptp(np.linalg.norm(whole, axis=1)) < 1e-7


def test_a_slide_that_the_others_cannot_hold_is_refused_before_it_starts(cli, tmp_path):
    weak = (*SLIDE, "contact.sliding.way_m=[0,0,0.005]", "contact.sliding.friction_reserve=0.99")
    finished = cli("manipulate", *weak, "--json", "-o", tmp_path)
    assert finished.code == 1
    assert "no contact forces balance the load while" in finished.document["reason"]
    assert "contact.sliding" in finished.stderr + str(finished.document)
    assert finished.document["sliding"] is None


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (("contact.sliding.fingers=[4]",), "a finger that 4 fingers do not have"),
        (("contact.sliding.fingers=[0,1,2,3]",), "lets all fingers slide"),
        (("contact.sliding.fingers=[1,1]",), "names a finger twice"),
        (("contact=frictionless", "contact.sliding.fingers=[1]"), "fits no contacts of kind"),
        (("motion=gait", "contact.sliding.fingers=[1]"), "does not go with finger gaiting"),
    ],
)
def test_unusable_options_are_one_sentence(cli, tmp_path, overrides, words):
    finished = cli("manipulate", "hand.fingers=4", *overrides, "-o", tmp_path / "results")
    assert finished.code == 2
    assert words in finished.stderr.strip().splitlines()[-1]
    assert not (tmp_path / "results").exists()


def test_a_finger_slides_in_physics_while_the_others_hold(cli, tmp_path):
    far = ("contact.sliding.way_m=[0,0,0.004]", "execution=default", "execution.lift_time_s=0.5")
    finished = cli("manipulate", *SLIDE, *far, "--json", "-o", tmp_path)
    assert finished.code == 0, finished.stderr
    played = finished.document["in_hand"]
    assert played["success"]
    # it really slides, about as far as planned, and the object stays
    assert played["slip_max_m"] == pytest.approx(finished.document["sliding"]["slid_max_m"], rel=0.4)
    assert played["position_error_max_m"] < 2e-3


def test_a_finger_that_slides_in_physics_asks_for_springs(cli, tmp_path):
    other = ("execution=default", "execution.control=object_impedance")
    finished = cli("manipulate", *SLIDE, *other, "-o", tmp_path / "results")
    assert finished.code == 2
    assert "execution.control=joint_impedance" in finished.stderr.strip().splitlines()[-1]
