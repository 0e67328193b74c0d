"""Contacts that slide on purpose: led over the surface, friction on the limit surface, the others held."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from graspbench.errors import ManipulationError
from graspbench.grasp.sliding_friction import Sliding
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.forces import ForceDistribution, ForceParameters, contact_frame
from graspbench.manipulation.least_forces import LeastForces
from graspbench.manipulation.manipulate import manipulate_object
from graspbench.manipulation.motion import MotionParameters, motion_share, object_motion
from graspbench.manipulation.sliding.sliding_check import check_sliding
from graspbench.manipulation.sliding.sliding_parameters import SlidingParameters
from tests.manipulation.boxes import box_hand
from tests.manipulation.test_forces import wrench_of
from tests.manipulation.test_gait import CLIK, CONTACT, RADIUS, ball_in, on_ball, radial

STILL = MotionParameters("hold", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, there_and_back=False)
WAY_M = 0.006
ROUND = (
    [[0.03, 0, 0], [0, 0.03, 0.004], [-0.03, 0, 0], [0, -0.03, 0.002]],
    [[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]],
)


def slid_on_ball(hand, contact, motion=STILL):
    grasp, _ = ball_in(hand)
    charts = [on_ball(point - grasp.centroid, None) for point in grasp.points]
    return manipulate_object(hand, grasp, charts, motion, CLIK, contact)


@pytest.fixture(scope="module")
def hand():
    return radial(4)


@pytest.fixture(scope="module")
def contact():
    return replace(CONTACT, sliding=SlidingParameters((0,), (0.0, 0.0, WAY_M), friction_reserve=0.1))


@pytest.fixture(scope="module")
def along_meridian(hand, contact):
    """The object rests, three fingers roll, and one slides along a meridian of the ball."""
    return slid_on_ball(hand, contact)


def test_a_finger_slides_along_a_meridian_in_closed_form(along_meridian, contact):
    result, mu = along_meridian, CONTACT.forces.friction
    assert result.position_error_m.max() <= 1e-6
    start = result.contact_points[0, 0]
    axis = np.cross(start, [0.0, 0.0, 1.0])
    axis /= np.linalg.norm(axis)
    up = np.cross(axis, start)
    for k in (0, 30, 50, 77, 100):  # control periods of 10 ms, forces every 100 ms
        share, _ = motion_share(STILL, result.history.times[k])
        angle = share * WAY_M / RADIUS
        sign = np.sign((result.contact_points[-1, 0] - start) @ up)
        expected = np.cos(angle) * start + sign * np.sin(angle) * up
        np.testing.assert_allclose(result.contact_points[k, 0], expected, atol=1e-8)
    # friction is mu N along the tip's velocity, and nothing else of the force is open
    sliding = result.sliding
    for k in (3, 5, 8):
        slip, force = sliding.slips[k, 0], result.forces[k, 0]
        normal = np.cross(slip, np.cross(force, slip))
        normal *= -np.sign(normal @ force) / np.linalg.norm(normal)
        friction = force - (force @ normal) * normal
        np.testing.assert_allclose(
            friction, mu * -(force @ normal) * slip / np.linalg.norm(slip), rtol=1e-9, atol=1e-12
        )
        assert sliding.margins[k, 0] == 0.0
        assert np.abs(sliding.slips[k, 1:]).max() < 1e-9
        weight = contact.carried_kg * 9.81
        np.testing.assert_allclose(np.linalg.norm(result.forces[k].sum(axis=0)), weight, atol=1e-9)
    assert sliding.margins[:, 1:].min() > 0.0
    assert result.summary()["force_margin_min_n"] == pytest.approx(sliding.margins[:, 1:].min())


def test_the_check_finds_nothing_wrong(hand, contact, along_meridian):
    found = check_sliding(hand, along_meridian, contact)
    assert found.violations == ()
    assert found.balance_error_max <= 1e-9
    assert found.surface_error_max <= 1e-6
    assert found.stuck_slip_max_m <= 1e-6
    assert found.reserve_min >= 0.1 - 1e-6
    # rolling of the tip adds to the way of the contact, or takes from it
    assert 0.5 * WAY_M < found.slid_max_m < 2.0 * WAY_M


@pytest.mark.parametrize("kind", ["rolling", "hard"])
def test_a_finger_slides_while_the_object_moves(hand, kind):
    motion = MotionParameters("move", (0.0, 0.0, 0.004), (0.0, 0.0, 6.0), 2.0)
    sliding = SlidingParameters((1,), (0.0, 0.0, 0.003), wrench=(0.0, 0.0, 0.05, 0.0, 0.0, 1e-3))
    chosen = replace(CONTACT, kind=kind, sliding=sliding)
    result = slid_on_ball(hand, chosen, motion)
    assert check_sliding(hand, result, chosen).violations == ()
    np.testing.assert_allclose(result.contact_points[-1, 1], result.contact_points[0, 1], atol=1e-6)
    farthest = np.linalg.norm(result.contact_points[100, 1] - result.contact_points[0, 1])
    assert farthest == pytest.approx(2.0 * RADIUS * np.sin(0.5 * 0.003 / RADIUS), abs=1e-6)


def test_without_a_way_the_contact_goes_where_hand_and_contacts_move_least(hand):
    chosen = replace(CONTACT, sliding=SlidingParameters((0,)))
    turned = MotionParameters("turn", (0.0, 0.0, 0.0), (0.0, 0.0, 8.0), 1.0, there_and_back=False)
    result = slid_on_ball(hand, chosen, turned)
    found = check_sliding(hand, result, chosen)
    assert found.violations == ()
    assert found.slid_max_m > 1e-4


@pytest.mark.parametrize("fault", ["friction", "surface", "balance", "stuck", "reserve"])
def test_the_check_finds_faults_put_in(hand, contact, along_meridian, fault):
    result, forces = along_meridian, along_meridian.forces.copy()
    if fault == "friction":  # with the slip turned round, friction drives the motion
        normals = np.einsum("tij,tj->ti", result.desired_transforms_object_to_palm[::10, :3, :3],
                            result.contact_normals[::10, 0])  # fmt: skip
        pressing = np.einsum("ti,ti->t", forces[:, 0], normals)[:, None] * normals
        forces[:, 0] = 2.0 * pressing - forces[:, 0]
        word = "deg off the way"
    elif fault == "surface":
        forces[5, 0] += 0.01 * result.sliding.slips[5, 0]
        word = "off the limit surface"
    elif fault == "balance":
        forces[5, 1] *= 1.01
        word = "miss the load"
    elif fault == "reserve":
        contact = replace(contact, sliding=replace(contact.sliding, friction_reserve=0.6))
        word = "lacks"
    else:
        result = replace(result, sliding=replace(result.sliding, contacts=(1,)))
        word = "a contact that sticks slides"
    found = check_sliding(hand, replace(result, forces=forces), contact)
    assert any(word in clause for clause in found.violations)


def test_three_fingers_in_a_plane_cannot_hold_what_one_of_them_drags_out_of_it():
    """The drag's moment is R mu N, and two thirds of it more: no forces across the plane balance both."""
    three = radial(3)
    chosen = replace(CONTACT, sliding=SlidingParameters((0,), (0.0, 0.0, WAY_M)))
    with pytest.raises(ManipulationError, match="no contact forces balance the load while finger 0 slides"):
        slid_on_ball(three, chosen)


def test_a_way_into_the_object_is_refused(hand):
    grasp, _ = ball_in(hand)
    normal = grasp.posture.transform_palm_to_world[:3, :3].T @ grasp.normals[0]
    chosen = replace(CONTACT, sliding=SlidingParameters((0,), tuple(0.004 * normal)))
    with pytest.raises(ManipulationError, match="does not run along"):
        slid_on_ball(hand, chosen)


def test_a_finger_that_does_not_grasp_cannot_slide(hand):
    with pytest.raises(ManipulationError, match="names finger 7, which does not touch"):
        slid_on_ball(hand, replace(CONTACT, sliding=SlidingParameters((7,))))


def test_torsion_of_two_soft_fingers_holds_what_a_third_drags_along_a_cylinder():
    """Its moment about their line is R mu N: half of it each, and hard contacts cannot."""
    points, normals = [[0.03, 0, 0], [-0.03, 0, 0], [0, 0.03, 0]], [[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0]]
    parameters = ForceParameters(friction=0.5, torsion_m=0.005, minimum_n=0.2)
    slides = {2: Sliding(np.array([0.0, 0.0, 0.01]))}
    soft = box_hand(points, normals, "soft", joints=4)
    found = ForceDistribution(parameters)(soft, np.zeros(6), slides)
    assert found.normal_forces[2] == pytest.approx(0.2, abs=1e-8)
    np.testing.assert_allclose(found.forces[2], [0.0, -0.2, 0.1], atol=1e-8)
    np.testing.assert_allclose(found.torsions, [-0.0015, 0.0015, 0.0], atol=1e-9)
    np.testing.assert_allclose(found.normal_forces[:2], 0.0015 / 0.005, atol=1e-7)
    with pytest.raises(ManipulationError):
        ForceDistribution(parameters)(box_hand(points, normals, "hard", joints=4), np.zeros(6), slides)


def linear_programme(state, load, sliding, parameters, reserve):
    """What the distribution solves, written down again: equations, and bounds of normal and friction."""
    p, columns, rows, highs, n = parameters, [], [], [], 0
    sizes = [1 if i in sliding else 3 for i in range(state.system.n_contacts)]
    for i, size in enumerate(sizes):
        normal, tangents, lever = contact_frame(state, i)
        if size == 1:
            velocity = sliding[i].velocity - (sliding[i].velocity @ normal) * normal
            own = [p.friction * velocity / np.linalg.norm(velocity) - normal]
        else:
            own = [-normal, tangents[:, 0], tangents[:, 1]]
            for angle in 2.0 * np.pi * np.arange(p.cone_edges) / p.cone_edges:
                row = np.zeros(sum(sizes))
                inner = (1.0 - reserve) * p.friction * np.cos(np.pi / p.cone_edges)
                row[n : n + 3] = [-inner, np.cos(angle), np.sin(angle)]
                rows.append(row)
                highs.append(0.0)
        for sign, bound in ((-1.0, -p.minimum_n), (1.0, p.maximum_n)):
            row = np.zeros(sum(sizes))
            row[n] = sign
            rows.append(row)
            highs.append(bound)
        columns += [np.concatenate([force, np.cross(lever, force)]) for force in own]
        n += size
    return np.array(columns).T, load, np.array(rows), np.array(highs)


def test_the_distribution_against_two_other_solvers():
    """Feasible where a linear programme is, as small as SLSQP finds, in balance within 1e-9, with reserve.

    Loads and slips are random, so that many are just inside or outside what the contacts can do.
    """
    state = box_hand(*ROUND, "hard", joints=4)
    parameters, reserve = ForceParameters(friction=0.5, maximum_n=3.0), 0.1
    rng, feasible, compared = np.random.default_rng(1), 0, 0
    count = 60
    for _ in range(count):
        load = rng.normal(size=6) * np.array([1.0, 1.0, 1.0, 0.03, 0.03, 0.03])
        sliding = {0: Sliding(rng.normal(size=3))}
        grasp, wanted, rows, highs = linear_programme(state, load, sliding, parameters, reserve)
        known = linprog(np.zeros(len(grasp.T)), rows, highs, grasp, wanted, bounds=(None, None))
        try:
            found = ForceDistribution(parameters, reserve)(state, load, sliding)
        except ManipulationError:
            assert known.status != 0
            continue
        assert known.status == 0
        feasible += 1
        np.testing.assert_allclose(wrench_of(state, found.forces, found.torsions), load, atol=1e-9)
        normal = contact_frame(state, 0)[0]
        velocity = sliding[0].velocity - (sliding[0].velocity @ normal) * normal
        friction = found.forces[0] + found.normal_forces[0] * normal
        bound = 0.5 * found.normal_forces[0]
        assert np.linalg.norm(friction) == pytest.approx(bound, rel=1e-9)
        # of all frictions that the surface allows none takes more power out of the motion
        angles = np.linspace(0.0, 2.0 * np.pi, 1000)
        tangents = contact_frame(state, 0)[1]
        all_of_them = bound * (
            np.cos(angles)[:, None] * tangents[:, 0] + np.sin(angles)[:, None] * tangents[:, 1]
        )
        assert friction @ velocity >= (all_of_them @ velocity).max() - 1e-9
        assert found.margins[1:].min() >= (reserve * 0.5 * found.normal_forces[1:]).min() - 1e-8
        assert np.all(found.margins[1:] >= reserve * 0.5 * found.normal_forces[1:] - 1e-8)
        if compared < 8:
            compared += 1
            other = minimize(
                lambda x: x @ x, known.x, jac=lambda x: 2.0 * x, method="SLSQP",
                options={"maxiter": 500, "ftol": 1e-14},
                constraints=[
                    {"type": "eq", "fun": lambda x, g=grasp, w=load: g @ x - w},
                    {"type": "ineq", "fun": lambda x, r=rows, h=highs: h - r @ x},
                ],
            )  # fmt: skip
            own = found.normal_forces @ found.normal_forces + sum(
                float(np.sum((f + n * contact_frame(state, i)[0]) ** 2))
                for i, (f, n) in enumerate(zip(found.forces, found.normal_forces, strict=True))
                if i > 0
            )
            assert own == pytest.approx(other.fun, rel=1e-5)
    assert 10 < feasible < count - 10


def test_forces_near_their_bounds_are_found():
    """ProxQP alone calls about one in a hundred of such programmes infeasible that are not."""
    rng = np.random.default_rng(3)
    both = [0, 0]
    for _ in range(150):
        grasp, rows = rng.normal(size=(6, 9)), rng.normal(size=(20, 9))
        inside = rng.normal(size=9)
        highs = rows @ inside + np.abs(rng.normal(size=20)) * 0.02 - 0.01 * rng.integers(0, 2)
        load = grasp @ (inside + 1e-3 * rng.normal(size=9))
        known = linprog(np.zeros(9), rows, highs, grasp, load, bounds=(None, None)).status == 0
        found = LeastForces()(grasp, load, rows, highs)
        if (found is not None) != known:  # on the very edge the two may differ
            loose = linprog(np.zeros(9), rows, highs + 1e-7, grasp, load, bounds=(None, None)).status == 0
            assert loose != known
            continue
        both[int(known)] += 1
        if found is not None:
            np.testing.assert_allclose(grasp @ found, load, atol=1e-9)
            assert (rows @ found - highs).max() <= 1e-8
    assert min(both) > 15


@pytest.mark.parametrize("there_and_back", [True, False])
def test_the_share_of_a_motion_is_that_of_its_path(there_and_back):
    motion = MotionParameters("m", (0.02, 0.0, 0.0), (0.0, 0.0, 0.0), 3.0, there_and_back=there_and_back)
    path = object_motion(motion, np.zeros(3), np.eye(3))
    for time_s in np.linspace(-0.1, 3.1, 33):
        share, rate = motion_share(motion, time_s)
        at = path(time_s)
        assert 0.02 * share == pytest.approx(at.position[0], abs=1e-12)
        assert 0.02 * rate == pytest.approx(at.twist[0], abs=1e-12)


def test_contacts_stick_by_default():
    assert ContactParameters().sliding.fingers == ()
