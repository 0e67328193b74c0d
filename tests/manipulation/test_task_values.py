"""What the tasks on manipulability, stiffness and friction cones measure: closed forms, and their effect."""

import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.manipulation.forces import contact_frame
from graspbench.manipulation.secondary_task import build_tasks
from tests.manipulation.boxes import TRIPOD, box_hand

TWIST = np.array([0.2, -0.5, 1.0, 3.0, 8.0, -5.0])
DIRECTION = {"translation": tuple(TWIST[:3]), "rotation": tuple(TWIST[3:])}


def task(name, **options):
    return build_tasks({name: options})[name]


def grasp_map(state):
    columns = []
    for lever in state.levers:
        columns += [np.concatenate([e, np.cross(lever, e)]) for e in np.eye(3)]
    return np.array(columns).T


def test_velocity_is_that_of_the_least_joint_motion():
    state = box_hand(*TRIPOD, "hard", joints=4)
    unit = TWIST / np.linalg.norm(TWIST)
    tips = state.tip_jacobians[:, :3].reshape(-1, state.system.n_joints)
    joints = np.linalg.lstsq(tips, grasp_map(state).T @ unit, rcond=None)[0]
    found = task("velocity_manipulability", **DIRECTION, threshold=100.0).evaluate(state)
    assert found.value[0] == pytest.approx(1.0 / np.linalg.norm(joints), rel=1e-9)


def test_wrench_is_that_of_the_least_contact_forces():
    state = box_hand(*TRIPOD, "hard", joints=4)
    unit = TWIST / np.linalg.norm(TWIST)
    forces = np.linalg.lstsq(grasp_map(state), unit, rcond=None)[0]
    torques = state.tip_jacobians[:, :3].reshape(-1, state.system.n_joints).T @ forces
    options = {"force": tuple(TWIST[:3]), "torque": tuple(TWIST[3:]), "threshold": 1e9}
    found = task("wrench_manipulability", **options).evaluate(state)
    assert found.value[0] == pytest.approx(1.0 / np.linalg.norm(torques), rel=1e-9)


@pytest.mark.parametrize("compliance", [0.0, 1e-3])
def test_stiffness_is_the_force_of_the_joints_springs_on_the_object(compliance):
    """Move the object, let every finger come to rest between springs and contact, add the forces up."""
    state = box_hand(*TRIPOD, "hard", joints=3)
    unit, spring = TWIST / np.linalg.norm(TWIST), 12.0
    wrench = np.zeros(6)
    for i, lever in enumerate(state.levers):
        moved = unit[:3] + np.cross(unit[3:], lever)
        jacobian = state.tip_jacobians[i, :3]
        # energy of springs and tip with the force as multiplier: spring q = J' f, J q + c f = moved
        n = state.system.n_joints
        system = np.block([[spring * np.eye(n), -jacobian.T], [jacobian, compliance * np.eye(3)]])
        force = np.linalg.solve(system, np.concatenate([np.zeros(n), moved]))[n:]
        wrench += np.concatenate([force, np.cross(lever, force)])
    options = {**DIRECTION, "joint_stiffness_nm_rad": spring, "tip_compliance_m_per_n": compliance}
    found = task("grasp_stiffness", **options, threshold=1e9).evaluate(state)
    assert found.value[0] == pytest.approx(unit @ wrench, rel=1e-6)


def test_the_cone_distance_is_the_angle_that_the_grip_force_has_left():
    state = box_hand(*TRIPOD, "hard", joints=4)
    found = task("cone_distance", friction=0.5, margin_deg=90.0).evaluate(state)
    points = np.array(TRIPOD[0])
    for i in range(3):
        force = points.mean(axis=0) - points[i]
        normal = contact_frame(state, i)[0]
        angle = np.arctan2(np.linalg.norm(np.cross(force, normal)), -force @ normal)
        assert found.value[i] == pytest.approx(np.arctan(0.5) - angle, abs=1e-9)
    assert task("cone_distance", friction=5.0, margin_deg=1.0).evaluate(state) is None


@pytest.mark.parametrize(
    "name", ["velocity_manipulability", "wrench_manipulability", "grasp_stiffness", "cone_distance"]
)
def test_moving_along_the_gradient_raises_the_value(name):
    state = box_hand(*TRIPOD, "frictionless", joints=4)
    options = {"margin_deg": 90.0} if name == "cone_distance" else {"threshold": 1e9}
    chosen = task(name, **options)
    before = chosen.evaluate(state)
    velocity = before.jacobian[0] / np.linalg.norm(before.jacobian[0])
    joints, variables = state.joints.copy(), state.contact_variables.copy()
    state.update(joints + 1e-4 * velocity[: state.system.n_joints], variables + 1e-4 * state.rates(velocity))
    assert chosen.evaluate(state).value[0] > before.value[0]


def test_a_demonstration_is_followed_where_the_object_is(tmp_path):
    state = box_hand(*TRIPOD, "hard", joints=4)
    n = state.system.n_joints
    path = tmp_path / "shown.csv"
    names = ["object_x_m", "object_y_m", "object_z_m", *(f"j{k}_rad" for k in range(n))]
    rows = [[0.0, 0.0, 0.0, *([0.3] * n)], [0.1, 0.0, 0.0, *([0.9] * n)]]
    np.savetxt(path, rows, delimiter=",", header=",".join(names), comments="")
    here = task("demonstrated_posture", file=str(path), width_m=0.01).evaluate(state)
    np.testing.assert_allclose(here.error, 0.3 - state.joints, atol=1e-9)
    wide = task("demonstrated_posture", file=str(path), width_m=10.0).evaluate(state)
    np.testing.assert_allclose(wide.error, 0.6 - state.joints, atol=1e-3)
    assert task("demonstrated_posture").evaluate(state) is None


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "No such file"),
        ("a,b\n1,2\n", "object_x_m"),
        ("object_x_m,object_y_m,object_z_m,q_rad\n0,0,0,word\n", "word"),
        ("object_x_m,object_y_m,object_z_m,q_rad\n", "no posture"),
        ("object_x_m,object_y_m,object_z_m,q_rad\n0,0,0,1\n", "1 joints but the hand 12"),
    ],
)
@pytest.mark.filterwarnings("ignore:loadtxt")
def test_a_demonstration_that_cannot_be_used_is_refused(tmp_path, content, message):
    state = box_hand(*TRIPOD, "hard", joints=4)
    path = tmp_path / "shown.csv"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ConfigurationError, match=message):
        task("demonstrated_posture", file=str(path)).evaluate(state)
