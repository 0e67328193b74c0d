import pytest
import yaml

from graspbench.cli.arguments import complete_override
from graspbench.errors import ConfigurationError
from graspbench.experiment import (
    group_options,
    load_config,
    load_manipulation_config,
    manipulation_config_from_tree,
)


def test_defaults_are_a_trial_and_three_sections():
    config = load_manipulation_config()
    assert config.object.name == "teddy"
    assert config.clik.method == "pseudo_inverse"
    assert config.motion.name == "screw"
    assert config.contact.kind == "rolling"
    assert set(config.clik.tasks) == {"joint_limit", "edge_distance", "manipulability", "joint_centring"}
    assert config.hand.margins.joint == 0.15
    plain = load_config(["hand.margins.joint=0.15", "hand.margins.singular_value_m=0.02", "execution=off"])
    assert {key: config.tree[key] for key in plain.tree} == plain.tree


def test_plain_trials_know_nothing_of_manipulation():
    assert not {"clik", "clik/tasks", "motion", "contact"} & set(group_options())
    assert not {"clik", "motion", "contact"} & set(load_config().tree)
    with pytest.raises(ConfigurationError, match="unknown option 'motion'"):
        load_config(["motion=screw"])


@pytest.mark.parametrize("group", ["clik", "clik/tasks", "motion", "contact"])
def test_every_option_of_the_groups_composes(group):
    options = group_options(primary="manipulate")[group]
    assert options
    for option in options:
        load_manipulation_config([f"{group}={option}", "hand.fingers=4"])


def test_groups_and_values_reach_the_parameters():
    groups = ["object=duck", "hand=allegro", "clik=qp", "clik/tasks=none", "motion=rotate", "contact=hard"]
    values = ["motion.rotation_deg=[0,0,5]", "clik.qp.limit_gain=50", "contact.forces.friction=0.7"]
    config = load_manipulation_config([*groups, *values])
    assert config.hand.name == "allegro"
    assert (config.clik.method, config.clik.integrator) == ("qp", "euler")
    assert dict(config.clik.tasks) == {}
    assert config.motion.rotation_deg == (0.0, 0.0, 5.0)
    assert config.clik.qp.limit_gain == 50.0
    assert (config.contact.kind, config.contact.forces.friction) == ("hard", 0.7)


def test_friction_of_the_forces_is_that_of_the_grasp_unless_given():
    assert load_manipulation_config(["quality.friction=0.35"]).contact.forces.friction == 0.35


def test_friction_of_a_task_is_that_of_the_grasp_unless_given():
    asked = ["clik.tasks.quality_measure.measure=q2", "quality.friction=0.35", "quality.cone_edges=6"]
    task = load_manipulation_config(asked).clik.tasks["quality_measure"]
    assert (task["friction"], task["cone_edges"]) == (0.35, 6)
    apart = load_manipulation_config([*asked, "clik.tasks.quality_measure.friction=0.9"])
    assert apart.clik.tasks["quality_measure"]["friction"] == 0.9


def test_thresholds_of_the_search_are_those_of_the_index_unless_given():
    asked = ["index=mirtich_canny", "index.phi_cei_deg=7"]
    assert load_config(asked).search.thresholds_deg == (7, 10)
    assert load_config([*asked, "search.phi_cei_deg=9"]).search.thresholds_deg == (9, 10)
    assert load_config(["index=force_field"]).search.thresholds_deg == (15, 10)


def test_a_task_is_brought_in_by_one_of_its_options():
    tasks = load_manipulation_config(["clik/tasks=none", "clik.tasks.edge_distance.gain=3"]).clik.tasks
    assert list(tasks) == ["edge_distance"]
    assert tasks["edge_distance"]["gain"] == 3
    assert "margin" in tasks["edge_distance"]


def test_a_tree_read_back_gives_the_same_manipulation():
    config = load_manipulation_config(["object=duck", "clik.tasks.joint_centring.gain=0.2"])
    text = yaml.safe_dump(config.as_tree())
    assert manipulation_config_from_tree(yaml.safe_load(text)).trial_id == config.trial_id


def test_identity_depends_on_motion_tasks_and_contact():
    ids = {
        load_manipulation_config(overrides).trial_id
        for overrides in ([], ["motion=rotate"], ["contact=hard"], ["clik.tasks.joint_limit.margin=0.2"])
    }
    assert len(ids) == 4
    assert load_config().trial_id not in ids
    assert load_manipulation_config(["record=off"]).trial_id in ids


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["motion=scrw"], ["unknown motion", "screw"]),
        (["contact=sticky"], ["unknown contact", "rolling"]),
        (["clik/tasks=all"], ["unknown clik/tasks", "hand"]),
        (["clik.gian=3"], ["unknown option", "clik.gain"]),
        (["clik.gain=-3"], ["clik.gain", "-3"]),
        (["clik.tasks.wishing.gain=1"], ["unknown task", "wishing", "joint_limit"]),
        (["clik.tasks.joint_limit.gian=1"], ["clik.tasks.joint_limit.gian", "gain"]),
        (["clik.tasks.joint_limit.margin=-1"], ["joint_limit", "margin"]),
        (["clik.tasks.joint_limit=5"], ["clik.tasks.joint_limit", "group"]),
        (["clik.tasks.manipulability.fingers=[5]"], ["manipulability.fingers", "3 fingers"]),
        (["clik.tasks.edge_distance.contacts=[0,7]"], ["edge_distance.contacts", "3 fingers"]),
        (["clik.step_s=1", "motion.duration_s=2"], ["clik.step_s", "motion.duration_s"]),
        (["motion.duration_s=0"], ["motion.duration_s"]),
        (["contact.forces.friction=no"], ["contact.forces.friction"]),
    ],
)
def test_every_mistake_is_one_sentence(overrides, words):
    with pytest.raises(ConfigurationError) as caught:
        load_manipulation_config(overrides)
    text = str(caught.value)
    assert "\n" not in text
    for word in words:
        assert word in text


def test_a_users_tasks_are_an_option(tmp_path):
    folder = tmp_path / "clik" / "tasks"
    folder.mkdir(parents=True)
    (folder / "mine.yaml").write_text("edge_distance:\n  gain: 7.0\n")
    (folder / "odd.yaml").write_text("edge_distance:\n  gian: 7.0\n")
    config = load_manipulation_config(["clik/tasks=mine"], tmp_path)
    assert config.clik.tasks["edge_distance"]["gain"] == 7.0
    with pytest.raises(ConfigurationError, match="gian"):
        load_manipulation_config(["clik/tasks=odd"], tmp_path)


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("cl", "clik/tasks="),
        ("clik/", "clik/tasks="),
        ("clik/tasks=", "clik/tasks=none"),
        ("contact=r", "contact=rolling"),
        ("motion.dur", "motion.duration_s="),
    ],
)
def test_completion_offers_the_nested_group(typed, offered):
    assert offered in complete_override(typed)


def test_completion_offers_only_what_composes():
    assert "clik/tasks." not in complete_override("clik")
    assert not [name for name in complete_override("clik.") if "defaults" in name]


@pytest.mark.parametrize(
    ("override", "word"),
    [
        ("contact=frictionless", "do not gait on contacts of kind 'frictionless'"),
        ("contact=soft_pad", "do not gait on contacts of kind 'soft_pad'"),
        ("hand.fingers=2", "two fingers cannot gait"),
        ("motion.gait.angle_deg=400", "motion.gait.angle_deg"),
    ],
)
def test_a_gait_that_can_never_be_done_is_refused_before_anything(override, word):
    with pytest.raises(ConfigurationError, match=word):
        load_manipulation_config(["motion=gait", override])
    assert load_manipulation_config(["motion=gait"]).motion.gait.angle_deg == 60.0


def test_a_gait_is_played_by_springs_in_the_joints_only():
    gait = ["motion=gait", "hand.fingers=4", "execution=default"]
    assert load_manipulation_config(gait).execution.until == "hold"
    with pytest.raises(ConfigurationError, match="fingers that step are not driven by"):
        load_manipulation_config([*gait, "execution.control=hybrid"])
