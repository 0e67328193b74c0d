"""Soft pads in manipulation: forces on their limit surfaces, and fingers that follow into them."""

import numpy as np
import pytest

from graspbench.errors import ManipulationError
from graspbench.grasp.soft_pad import PadParameters, limit_use
from graspbench.manipulation import charts
from graspbench.manipulation.clik import ClikParameters
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.forces import ForceDistribution, ForceParameters, contact_frame
from graspbench.manipulation.manipulate import manipulate_object
from graspbench.manipulation.motion import MotionParameters
from tests.manipulation.boxes import TRIPOD, box_hand
from tests.manipulation.test_forces import wrench_of
from tests.manipulation.test_manipulate import RADIUS, ball_grasp, hand  # noqa: F401

PAIR = [[0.05, 0, 0], [-0.05, 0, 0]], [[1.0, 0, 0], [-1.0, 0, 0]]


def pad_hand(*place):
    return box_hand(*place, "soft_pad", joints=4)


def test_a_torque_about_the_line_of_two_pads_needs_the_force_of_its_closed_form():
    """tau = 2 mu k c N^(1 + g): the patch grows with the load."""
    state = pad_hand(*PAIR)
    for exponent in (0.0, 0.2, 1 / 3):
        parameters = ForceParameters(pad=PadParameters(exponent=exponent), minimum_n=0.01, maximum_n=1e3)
        for torque in (1e-3, 2e-2):
            found = ForceDistribution(parameters)(state, np.array([0, 0, 0, torque, 0, 0]))
            alone = 2.0 * 0.5 * (3 * np.pi / 16) * 0.0025
            expected = (torque / alone) ** (1.0 / (1.0 + exponent))
            np.testing.assert_allclose(found.normal_forces, expected, rtol=1e-3)


def test_weight_and_torque_share_the_friction_by_the_ellipse():
    state = pad_hand(*PAIR)
    parameters = ForceParameters(pad=PadParameters(exponent=0.0), minimum_n=0.01)
    weight, torque = 2.0, 2e-3
    found = ForceDistribution(parameters)(state, np.array([0, 0, weight, torque, 0, 0]))
    sideways, turning = weight / 0.5, torque / (0.5 * 3 * np.pi / 16 * 0.0025)
    np.testing.assert_allclose(found.normal_forces, np.hypot(sideways, turning) / 2.0, rtol=1e-3)
    assert found.smallest_margin == pytest.approx(0.0, abs=1e-3)


def test_random_loads_are_balanced_on_or_inside_the_limit_surfaces():
    state = pad_hand(*TRIPOD)
    p = ForceParameters(friction=0.8, maximum_n=1e3)
    distribute = ForceDistribution(p)
    rng, solved = np.random.default_rng(0), 0
    for _ in range(20):
        load = rng.normal(size=6) * np.array([0.3, 0.3, 0.3, 0.01, 0.01, 0.01])
        try:
            found = distribute(state, load)
        except ManipulationError:
            continue
        solved += 1
        np.testing.assert_allclose(wrench_of(state, found.forces, found.torsions), load, atol=1e-6)
        for i, force in enumerate(found.forces):
            normal = contact_frame(state, i)[0]
            normal_n = -force @ normal
            sideways = np.linalg.norm(force + normal_n * normal)
            torsion_m = p.pad.torsion_m(normal_n, p.friction)
            assert limit_use(sideways, found.torsions[i], normal_n, p.friction, torsion_m) <= 1.0 + 1e-3
    assert solved >= 10


def test_fingers_follow_into_their_pads_as_far_as_the_load_indents_them(hand, ball_grasp):  # noqa: F811
    each = [charts.sphere(RADIUS, towards=point - ball_grasp.centroid) for point in ball_grasp.points]
    motion = MotionParameters(duration_s=1.0, translation_m=(0.0, 0.0, 0.003), rotation_deg=(0.0, 0.0, 2.0))
    contact = ContactParameters(kind="soft_pad", mass_kg=0.1)
    clik = ClikParameters(step_s=5e-3)
    result = manipulate_object(hand, ball_grasp, each, motion, clik, contact)
    assert result.position_error_m.max() <= 1e-4
    assert result.rotation_error_deg.max() <= 0.1
    assert result.contact_drift_m.max() <= 1e-5
    pad, step = contact.forces.pad, round(1.0 / (contact.force_rate_hz * clik.step_s))
    deepest = 0.0
    for k in range(1, len(result.force_times) - 1):
        period = k * step  # here the pads have come to what the forces before did to them
        pose = result.transforms_object_to_palm[period]
        tips = (hand.tip_positions(result.history.joints[period]) - pose[:3, 3]) @ pose[:3, :3]
        depths = RADIUS + hand.tip_radius_m - np.linalg.norm(tips, axis=1)
        forces = result.forces[k - 1] @ pose[:3, :3]
        normal_n = -np.sum(forces * (tips / np.linalg.norm(tips, axis=1)[:, None]), axis=1)
        expected = [pad.yielding(n, hand.tip_radius_m).indentation_m for n in normal_n]
        np.testing.assert_allclose(depths, expected, rtol=0.1, atol=3e-5)
        deepest = max(deepest, depths.max())
    assert deepest > 1e-4
    assert result.pad_indentation_max_m == pytest.approx(deepest, rel=0.1)
