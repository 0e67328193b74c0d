import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.manipulation.clik import Clik, ClikParameters
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem
from graspbench.manipulation.secondary_task import TASKS, build_tasks
from tests.manipulation.cases import CHARTS, random_tree

STEP = 1e-6
KINDS = ("frictionless", "rolling", "frictionless", "hard")

# Every registered kind of task, with options under which it is active at random configurations.
OPTIONS = {
    "joint_limit": {"upper": (0.0,) * 17, "lower": (-9.0,) * 17, "margin": 3.0},
    "fingertip_distance": {"first": 1, "second": 3, "minimum_m": 0.5, "threshold_m": 5.0},
    "contacts_near_point": {"contacts": (0, 2), "middle_of": (1, 3)},
    "joint_centring": {"posture": (0.1,) * 17},
    "manipulability": {"fingers": (2, 0), "threshold": 1.0},
    "edge_distance": {"margin": 0.49},
    "quality_measure": {"measure": "q2", "target": 1.0},
    "velocity_manipulability": {
        "translation": (0.3, -1.0, 0.5), "rotation": (4.0, 9.0, -6.0), "threshold": 9.0,
    },
    "wrench_manipulability": {"force": (0.3, -1.0, 0.5), "torque": (0.1, 0.05, -0.08), "threshold": 1e3},
    "grasp_stiffness": {
        "translation": (0.2, 1.0, -0.5), "rotation": (5.0, -3.0, 8.0), "threshold": 1e7,
        "joint_stiffness_nm_rad": 7.0, "tip_compliance_m_per_n": 1e-4,
    },
    "cone_distance": {"friction": 0.3, "margin_deg": 80.0},
    "demonstrated_posture": {"width_m": 0.05},
}  # fmt: skip

# The gradient is itself a difference, or the difference suffers near singular grasps.
ROUGH = ("quality_measure", "velocity_manipulability", "wrench_manipulability", "grasp_stiffness")


def make_system(chart, rng):
    return ManipulationSystem(random_tree(rng), [Contact(chart, kind, 0.012) for kind in KINDS])


def random_state(system, case, rng):
    _, u, v = case
    variables = rng.uniform(-0.5, 0.5, (4, 5))
    variables[:, 0], variables[:, 1] = rng.uniform(*u, 4), rng.uniform(*v, 4)
    return system.state(rng.uniform(-2.0, 2.0, system.n_joints), variables)


def demonstration(folder, system, rng):
    """Write random postures by random positions of the object, with other columns between."""
    path = folder / "demonstration.csv"
    names = ["time_s", "object_x_m", "object_y_m", "object_z_m"]
    names += [f"joint_{k}_{unit}" for k in range(system.n_joints) for unit in ("rad", "rad_s")]
    table = np.hstack([rng.uniform(-0.2, 0.2, (30, 4)), rng.uniform(-1, 1, (30, 2 * system.n_joints))])
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="", fmt="%.10g")
    return path


def test_every_registered_task_is_tested():
    assert set(TASKS.names()) == set(OPTIONS)


@pytest.mark.parametrize("name", sorted(OPTIONS))
def test_jacobian_matches_central_differences(name, chart_case, tmp_path):
    rng = np.random.default_rng(0)
    system = make_system(chart_case[0], rng)
    options = OPTIONS[name]
    if name == "demonstrated_posture":
        options = {**options, "file": str(demonstration(tmp_path, system, rng))}
    task = build_tasks({name: options})[name]
    rows = 0
    for _ in range(100):
        state = random_state(system, chart_case, rng)
        velocity = rng.normal(size=system.n_variables)
        rates, here = state.rates(velocity), task.evaluate(state)
        if here is None:
            continue
        joints, variables = state.joints.copy(), state.contact_variables.copy()
        ends = []
        for sign in (-1, 1):
            state.update(joints + sign * STEP * velocity[: system.n_joints], variables + sign * STEP * rates)
            ends.append(task.evaluate(state))
        if any(end is None or len(end.value) != len(here.value) for end in ends):
            continue  # a row came or went inside the difference
        expected = (ends[1].value - ends[0].value) / (2 * STEP)
        got = here.jacobian @ velocity
        scale = max(np.abs(expected).max(), np.abs(got).max(), 1e-3)
        tolerance = 1e-5 if name in ROUGH else 1e-6
        assert np.abs(got - expected).max() <= tolerance * scale
        assert np.all((here.activation >= 0.0) & (np.asarray(here.activation) <= 1.0))
        rows += len(here.value)
    assert rows >= 50 or (name == "edge_distance" and chart_case[0].name in ("plane", "cylinder"))


def test_joint_limit_points_inwards_and_fades_in():
    rng = np.random.default_rng(1)
    system = make_system(CHARTS["sphere"][0], rng)
    task = build_tasks({"joint_limit": {"joints": [3], "lower": [-1.0], "upper": [1.0], "margin": 0.2}})
    task = task["joint_limit"]
    joints = np.zeros(system.n_joints)
    assert task.evaluate(system.state(joints, np.zeros((4, 5)))) is None
    seen = []
    for q in np.linspace(0.8, 1.0, 50)[1:]:
        joints[3] = q
        value = task.evaluate(system.state(joints, np.zeros((4, 5))))
        assert value.error[0] < 0.0
        seen.append(value.activation[0])
    assert seen[0] < 1e-3
    assert seen[-1] == 1.0
    assert np.all(np.diff(seen) >= 0.0)
    joints[3] = -0.95
    assert task.evaluate(system.state(joints, np.zeros((4, 5)))).error[0] > 0.0


def test_presence_is_smooth_in_time():
    task = build_tasks({"joint_centring": {"start_s": 1.0, "end_s": 3.0, "ramp_s": 0.5}})["joint_centring"]
    times = np.linspace(0.0, 5.0, 5001)
    presence = np.array([task.presence(t) for t in times])
    assert presence[times <= 1.0].max() == 0.0
    assert presence[(times >= 1.5) & (times <= 3.0)].min() == 1.0
    assert presence[times >= 3.5].max() == 0.0
    assert np.abs(np.diff(presence)).max() < 5e-3
    # two continuous derivatives: the second difference has no jump
    assert np.abs(np.diff(presence, 3)).max() < 1e-5


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("joint_limit", {"joints": (17,)}, "names joints 17 but there are 17"),
        ("joint_limit", {"joints": (1, 2), "upper": (0.0,)}, "watches 2 joints but has 2 lower and 1 upper"),
        ("fingertip_distance", {"second": 4}, "names fingers 0, 4 but there are 4"),
        ("contacts_near_point", {"middle_of": (-1,)}, "names contacts 0, -1 but there are 4"),
        ("edge_distance", {"contacts": (9,)}, "names contacts 9 but there are 4"),
        ("manipulability", {"fingers": (4,)}, "names fingers 4 but there are 4"),
        ("joint_centring", {"posture": (0.0,)}, "has 1 joints but the hand 17"),
        ("velocity_manipulability", {"translation": (0.0, 0.0, 0.0)}, "has no direction"),
        ("wrench_manipulability", {"force": (0.0, 0.0, 0.0)}, "has no direction"),
        ("grasp_stiffness", {"translation": (0.0, 0.0, 0.0)}, "has no direction"),
    ],
)
def test_tasks_that_do_not_fit_the_hand_are_refused(name, options, message):
    system = make_system(CHARTS["sphere"][0], np.random.default_rng(1))
    with pytest.raises(ConfigurationError, match=message):
        Clik(system, lambda _: None, ClikParameters(), build_tasks({name: options}))


def test_build_tasks_orders_by_priority_and_takes_a_kind():
    tasks = build_tasks(
        {
            "near": {"kind": "contacts_near_point", "priority": 2, "contacts": [0]},
            "joint_limit": {"priority": 0},
            "apart": {"kind": "fingertip_distance", "priority": 1},
        }
    )
    assert list(tasks) == ["joint_limit", "apart", "near"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"juggle": {}}, "unknown task 'juggle'"),
        ({"joint_limit": {"gian": 1.0}}, "no option gian"),
        ({"joint_limit": {"gain": -1.0}}, "'joint_limit', gain"),
    ],
)
def test_wrong_options_are_refused(options, message):
    with pytest.raises(ConfigurationError, match=message):
        build_tasks(options)


def test_any_registered_measure_can_be_raised_and_one_of_which_less_is_better_lowered():
    rng = np.random.default_rng(4)
    case = CHARTS["sphere"]
    system = make_system(case[0], rng)
    raised = build_tasks({"quality_measure": {"measure": "isotropy", "target": 1.0}})["quality_measure"]
    lowered = build_tasks({"quality_measure": {"measure": "centre_distance", "target": 0.0}})[
        "quality_measure"
    ]
    for _ in range(5):
        state = random_state(system, case, rng)
        up, down = raised.evaluate(state), lowered.evaluate(state)
        assert up.error[0] == pytest.approx(1.0 - up.value[0])
        assert down.error[0] == pytest.approx(-down.value[0])
        joints, variables = state.joints.copy(), state.contact_variables.copy()
        velocity = down.jacobian[0] * STEP / np.linalg.norm(down.jacobian[0])
        state.update(joints - velocity[: system.n_joints], variables - state.rates(velocity))
        assert lowered.evaluate(state).value[0] < down.value[0]
    with pytest.raises(ConfigurationError, match="unknown measure"):
        build_tasks({"quality_measure": {"measure": "beauty"}})
