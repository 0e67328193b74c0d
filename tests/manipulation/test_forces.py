import numpy as np
import pytest

from graspbench.errors import ManipulationError
from graspbench.grasp.sliding_friction import Sliding
from graspbench.manipulation.forces import ForceDistribution, ForceParameters, contact_frame, is_force_closure
from tests.manipulation.boxes import OPPOSITE, TRIPOD, box_hand


def wrench_of(state, forces, torsions):
    total = np.zeros(6)
    for i, force in enumerate(forces):
        normal, _, lever = contact_frame(state, i)
        total[:3] += force
        total[3:] += np.cross(lever, force) + torsions[i] * normal
    return total


def test_two_opposite_contacts_carry_a_weight_by_its_closed_form():
    """Weight mg across the line of contacts: f_n = mg / (2 mu cos(pi / edges)) at the pyramid's side."""
    state = box_hand([[0.05, 0, 0], [-0.05, 0, 0]], [[1.0, 0, 0], [-1.0, 0, 0]], "hard")
    parameters = ForceParameters(friction=0.5, cone_edges=4, minimum_n=0.0)
    tangents = contact_frame(state, 0)[1]
    load = np.concatenate([2.0 * tangents[:, 0], np.zeros(3)])
    found = ForceDistribution(parameters)(state, load)
    # the pyramid's sides are across the tangents' directions
    np.testing.assert_allclose(found.normal_forces, 1.0 / (0.5 * np.cos(np.pi / 4)), rtol=1e-6)
    np.testing.assert_allclose(wrench_of(state, found.forces, found.torsions), load, atol=1e-7)


@pytest.mark.parametrize("kind", ["hard", "soft"])
def test_forces_balance_the_load_inside_the_cones(kind):
    state = box_hand(*TRIPOD, kind, joints=4)
    distribute = ForceDistribution(ForceParameters(friction=0.8, maximum_n=1e3))
    rng = np.random.default_rng(0)
    for _ in range(20):
        load = rng.normal(size=6) * np.array([0.3, 0.3, 0.3, 0.002, 0.002, 0.002])
        try:
            found = distribute(state, load)
        except ManipulationError:
            continue
        np.testing.assert_allclose(wrench_of(state, found.forces, found.torsions), load, atol=1e-6)
        assert found.normal_forces.min() >= 0.1 - 1e-6
        assert found.smallest_margin >= -1e-6
        assert found.smallest_margin == found.margins.min()
        for i, force in enumerate(found.forces):
            normal = contact_frame(state, i)[0]
            sideways = force - (force @ normal) * normal
            assert np.linalg.norm(sideways) <= -0.8 * (force @ normal) + 1e-6
        if kind != "soft":
            np.testing.assert_array_equal(found.torsions, 0.0)


def test_a_load_outside_the_cones_is_refused():
    state = box_hand(*OPPOSITE, "frictionless")
    with pytest.raises(ManipulationError, match="balance the load"):
        ForceDistribution(ForceParameters())(state, np.array([0.0, 0, 1, 0, 0, 0]))


def test_force_closure_of_known_grasps():
    two = box_hand([[0.05, 0, 0], [-0.05, 0, 0]], [[1.0, 0, 0], [-1.0, 0, 0]], "hard")
    assert not is_force_closure(two, [0.5, 0.5])  # no torque about the line
    points = [[0.05, 0.0, 0.0], [-0.05, 0.02, 0.0], [-0.05, -0.02, 0.01]]
    three = box_hand(points, [[1.0, 0, 0], [-1.0, 0, 0], [-1.0, 0, 0]], "hard")
    assert is_force_closure(three, [0.5, 0.5, 0.5])
    assert not is_force_closure(three, [0.0, 0.0, 0.0])


ACROSS = [[0.05, 0, 0], [-0.05, 0, 0], [0, 0, 0.02]], [[1.0, 0, 0], [-1.0, 0, 0], [0, 0, 1.0]]


def test_a_finger_slides_over_a_box_that_two_others_hold():
    """Pressing N on top and sliding along x at friction mu drags by mu N: the side fingers take it up."""
    state = box_hand(*ACROSS, "hard")
    parameters = ForceParameters(friction=0.5, minimum_n=1.0)
    load = np.array([0.0, 0, 0, 0, 0.02 * 0.5 * 1.0, 0])  # 1 N on top drags by 0.5 N at 20 mm above
    found = ForceDistribution(parameters)(state, load, {2: Sliding(np.array([0.3, 0.0, 7.0]))})
    np.testing.assert_allclose(found.forces[2], [0.5, 0.0, -1.0], atol=1e-6)
    assert found.margins[2] == 0.0
    # along x the side fingers differ by the drag, along z they carry the pressure, half each
    assert found.normal_forces[0] - found.normal_forces[1] == pytest.approx(0.5, abs=1e-6)
    np.testing.assert_allclose(found.forces[:2, 2], 0.5, atol=1e-6)
    np.testing.assert_allclose(wrench_of(state, found.forces, found.torsions), load, atol=1e-6)
    assert found.smallest_margin >= -1e-6


@pytest.mark.parametrize("kind", ["soft", "soft_pad"])
def test_a_sliding_pad_has_its_friction_on_the_limit_surface(kind):
    state = box_hand(*ACROSS, kind, joints=4)
    p = ForceParameters(friction=0.5, minimum_n=2.0)
    slides = Sliding(np.array([0.005, 0.0, 0.0]), 1.5)
    found = ForceDistribution(p)(state, np.zeros(6), {2: slides})
    normal_n, torsion_m = found.normal_forces[2], p.torsion_m
    if kind == "soft_pad":
        torsion_m = p.pad.torsion_m(normal_n, p.friction)
    sideways = found.forces[2] + normal_n * np.array([0.0, 0.0, 1.0])
    use = np.hypot(np.linalg.norm(sideways) / p.friction, found.torsions[2] / torsion_m) / normal_n
    assert use == pytest.approx(1.0, abs=1e-7)
    # normality: the twist is along the limit surface's normal
    np.testing.assert_allclose(
        sideways / p.friction**2 * slides.spin_rad_s,
        slides.velocity * found.torsions[2] / torsion_m**2,
        rtol=1e-6,
        atol=1e-9,
    )
    np.testing.assert_allclose(wrench_of(state, found.forces, found.torsions), 0.0, atol=1e-6)
    assert found.smallest_margin > 0.0


def test_a_slide_that_the_others_cannot_hold_is_refused():
    state = box_hand(*ACROSS, "hard")
    parameters = ForceParameters(friction=0.5, minimum_n=20.0, maximum_n=20.0)
    with pytest.raises(ManipulationError, match="balance the load"):  # 10 N of friction against 20 N on top
        ForceDistribution(parameters)(state, np.zeros(6), {2: Sliding(np.array([1.0, 0.0, 0.0]))})
