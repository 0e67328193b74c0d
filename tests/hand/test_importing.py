"""Hands read from published kinds of files: what is found, given, written, and refused."""

import importlib.util
from pathlib import Path

import numpy as np
import pinocchio
import pytest

from graspbench.errors import ConfigurationError, HandError
from graspbench.experiment import add_hand, load_config
from graspbench.hand import load_hand
from graspbench.hand.importing.guesses import guesses_of
from graspbench.hand.importing.importer import Guesses, ImportedHand, import_hand
from graspbench.hand.importing.mjcf import urdf_of_mjcf
from graspbench.hand.importing.opposition_climb import beyond_tips
from graspbench.hand.importing.ranges import usual_range
from graspbench.hand.verification import overlaps
from tests.hand.small_hands import (
    PALM,
    fingers,
    joint,
    link,
    one_joint_coupled,
    parallel_gripper,
    three_joints,
    two_joints,
    written,
)

WRIST = '<link name="arm"/>' + joint("wrist", "arm", "palm", "0 1 0", at="0 0 0.1")
NO_MUJOCO = importlib.util.find_spec("mujoco") is None
MJCF = """<mujoco model="small"><compiler angle="degree"/><worldbody><body name="palm"><freejoint/>
<geom type="cylinder" size="0.05 0.01" pos="0 0 -0.01" mass="0.2"/>{fingers}</body></worldbody>
{equality}</mujoco>"""
MJCF_FINGER = """<body name="{n}_a" pos="{x} {y} 0" euler="0 0 {yaw}">
<joint name="{n}1" axis="1 0 0" range="-35 35" pos="0 0 0.001"/>
<inertial pos="0 0 0" mass="0.02" diaginertia="1e-5 1e-5 1e-5"/>
<body name="{n}_b"><joint name="{n}2" axis="0 -1 0" range="-45 57" actuatorfrcrange="-1.5 1.5"/>
<geom type="capsule" fromto="0 0 0.01 0 0 0.07" size="0.006" mass="0.02"/>
<geom type="box" size="0.1 0.1 0.1" contype="0" conaffinity="0" mass="0"/>
<body name="{n}_c" pos="0 0 0.07"><joint name="{n}3" axis="0 -1 0" range="-11 90"/>
<geom type="capsule" fromto="0 0 0.005 0 0 0.05" size="0.008" mass="0.02"/></body></body></body>"""


def write_mjcf(path: Path, equality: str = "") -> Path:
    text = ""
    for k, n in enumerate("fgh"):
        angle = 2 * np.pi * k / 3
        text += MJCF_FINGER.format(n=n, x=0.05 * np.cos(angle), y=0.05 * np.sin(angle), yaw=120 * k)
    path.write_text(MJCF.format(fingers=text, equality=equality))
    return path


def three_fingers(path: Path, above: str = "") -> Path:
    return written(path, above + PALM + fingers(3, three_joints))


def assert_opposes(found: ImportedHand, imbalance: float = 0.3) -> None:
    hand = found.hand
    tips = hand.tip_positions(hand.preferred)
    assert tips.mean(axis=0)[2] > 0.02  # in front of the palm frame
    assert found.opposition.imbalance < imbalance
    assert overlaps(hand, hand.preferred) == ()
    away = tips - tips.mean(axis=0)
    assert np.linalg.norm(away, axis=1).min() > hand.tip_radius_m


def test_palm_fingers_and_tips_are_found(tmp_path):
    found = import_hand(three_fingers(tmp_path / "own.urdf"), "own", Guesses())
    assert found.structure.palm == "palm"
    assert [finger.joints for finger in found.structure.fingers] == [
        ("f1", "f2", "f3"),
        ("g1", "g2", "g3"),
        ("h1", "h2", "h3"),
    ]
    for finger in found.parameters.chains:
        assert finger.tip.endswith("_c")
        # The end of the link, 55 mm along it, on the side that closes (x < 0): a little proud of both.
        assert 0.0 < finger.tip_xyz_m[2] + found.parameters.tip_radius_m - 0.055 < 5e-3
        assert abs(finger.tip_xyz_m[1]) < 1e-3
    z = found.opposition.transform_palm_to_link[:3, 2]
    assert z[2] > 0.85
    assert_opposes(found)


def test_a_ball_at_the_tip_is_taken_as_it_is(tmp_path):
    path = written(tmp_path / "own.urdf", PALM + fingers(3, lambda n, at: three_joints(n, at, ball=True)))
    found = import_hand(path, "own", Guesses())
    assert found.parameters.tip_radius_m == pytest.approx(0.009)
    for finger in found.parameters.chains:
        np.testing.assert_allclose(finger.tip_xyz_m, (0.0, 0.0, 0.055), atol=1e-6)


def test_a_wrist_is_found_and_held(tmp_path):
    found = import_hand(three_fingers(tmp_path / "own.urdf", WRIST), "own", Guesses())
    assert found.structure.palm == "palm"
    assert found.structure.wrist == ("wrist",)
    assert "wrist" not in found.hand.joint_names


@pytest.mark.parametrize("finger", [one_joint_coupled, two_joints])
def test_fingers_of_few_joints_oppose(tmp_path, finger):
    found = import_hand(written(tmp_path / "own.urdf", PALM + fingers(3, finger)), "own", Guesses())
    # Three fingers of one joint each leave the wrist no choice at all.
    assert found.parameters.fingers == (2 if finger is one_joint_coupled else 3)
    assert_opposes(found)


def test_a_parallel_gripper_closes_between_its_fingers(tmp_path):
    found = import_hand(parallel_gripper(tmp_path / "gripper.urdf"), "gripper", Guesses())
    assert found.parameters.fingers == 2
    assert [finger.posture_deg is not None for finger in found.parameters.chains] == [True, True]
    assert found.opposition.transform_palm_to_link[2, 2] > 0.99
    left, right = sorted(found.hand.tip_positions(found.hand.preferred)[:, 0])
    assert right - left > 2 * found.hand.tip_radius_m
    assert_opposes(found)


def test_wide_limits_do_not_curl_the_fingers_under_the_palm(tmp_path):
    """Published files state half a turn for every joint where the real ones are not known."""
    wide = (PALM + fingers(3, three_joints)).replace('lower="-0.8" upper="1.0"', 'lower="0" upper="3.1416"')
    wide = wide.replace('lower="-0.2" upper="1.6"', 'lower="0" upper="3.1416"')
    found = import_hand(written(tmp_path / "own.urdf", wide), "own", Guesses())
    assert_opposes(found)
    hand = found.hand
    assert found.opposition.transform_palm_to_link[2, 2] > 0.85
    tips = hand.tip_positions(hand.preferred)
    for f in range(hand.n_fingers):  # no knuckle is farther from the palm than its tip
        data = hand.model.createData()
        pinocchio.forwardKinematics(hand.model, data, hand.preferred)
        joint = hand.model.getJointId(hand.joint_names[hand.finger_joints(f)[-1]])
        knuckle = np.linalg.inv(hand.transform_palm_to_root) @ data.oMi[joint].homogeneous
        assert knuckle[2, 3] < tips[f, 2] + 0.01


@pytest.mark.parametrize(
    ("limits", "usual"),
    [((0, 180), (0, 110)), ((-180, 0), (-110, 0)), ((-180, 180), (-55, 55)), ((-90, 90), (-55, 55)),
     ((-30, 90), (-30, 90)), ((10, 200), (10, 200)), ((-45, 124), (-45, 124)), ((90, 360), (90, 200))],
)  # fmt: skip
def test_wide_ranges_are_drawn_in_towards_where_a_finger_is_straight(limits, usual):
    lower, upper = np.radians(np.array(limits, dtype=float)).reshape(2, 1)
    found = np.degrees(usual_range(lower, upper, np.array([True])))
    np.testing.assert_allclose(found[:, 0], usual, atol=1e-9)
    assert usual_range(lower, upper, np.array([False]))[1] == upper


def test_what_is_beyond_the_tips_is_measured_across_their_plane():
    tips = np.array([[0.03, 0.0, 0.1], [-0.03, 0.02, 0.1], [-0.03, -0.02, 0.1]])
    centre, away = np.array([0.0, 0.0, 0.1]), np.array([0.01, 0.0, 0.1])
    knuckles, palm = np.array([[[0.1, 0.2, 0.13]], [[0.0, 0.0, 0.02]]]), np.array([[0.0, 0.0, 0.0]])
    assert beyond_tips(tips, knuckles, palm, centre, away) == pytest.approx(0.03)
    assert beyond_tips(tips[:2], knuckles[1:], np.array([[0.0, 0.0, 0.15]]), centre, away) == pytest.approx(
        0.05, abs=2e-3
    )
    assert beyond_tips(tips, knuckles[1:], palm, centre, away) == pytest.approx(-0.08)


def test_what_is_given_is_kept(tmp_path):
    guesses = guesses_of(
        palm="palm",
        approach="0,0,2",
        fingers=2,
        drop=["h"],
        tips=["f=f_c:0,0,40"],
        tip_radius_mm=7.0,
        tip_shape="link",
        postures=["g=1,2,30"],
        rests=["g=0,-5,5"],
        locks=["f1=3"],
        object_mm=40.0,
        package_dirs=[],
    )
    p = import_hand(three_fingers(tmp_path / "own.urdf"), "own", guesses).parameters
    given = {finger.name: finger for finger in p.chains}
    assert set(given) == {"f", "g"}
    assert given["f"].tip_xyz_m == (0.0, 0.0, 0.04)
    assert given["g"].posture_deg == (1.0, 2.0, 30.0)
    assert given["g"].rest_deg == (0.0, -5.0, 5.0)
    assert p.locked_deg == {"f1": 3.0}
    assert p.tip_radius_m == 0.007
    assert p.tip_shape == "link"
    assert p.fingers == 2


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"tips": ["f"]}, "not of the form FINGER=LINK:X,Y,Z"),
        ({"tips": ["f=f_c:1,2"]}, "has 2 numbers"),
        ({"postures": ["f=a,b"]}, "has 'a,b' for numbers"),
        ({"locks": ["f1=1,2"]}, "has 2 numbers"),
        ({"approach": "0,0,0"}, "has no direction"),
        ({"object_mm": -1.0}, "--object-mm is -1.0"),
        ({"tip_shape": "cube"}, "--tip-shape is 'cube'"),
    ],
)
def test_guesses_of_the_wrong_form_are_refused(changed, said):
    plain = dict.fromkeys(("drop", "tips", "postures", "rests", "locks", "package_dirs"), ())
    plain |= dict.fromkeys(("palm", "approach", "fingers", "tip_radius_mm")) | {
        "object_mm": 60.0,
        "tip_shape": "sphere",
    }
    with pytest.raises(ConfigurationError, match=said):
        guesses_of(**plain | changed)


@pytest.mark.parametrize(
    ("guesses", "said"),
    [
        (Guesses(palm="hand"), "has no link 'hand'"),
        (Guesses(palm="f_a"), "has 1 finger"),
        (Guesses(drop=("thumb",)), "no finger 'thumb' to drop"),
        (Guesses(drop=("f", "g")), "has 1 finger"),
        (Guesses(postures_deg={"thumb": (1.0,)}), "no finger 'thumb'"),
        (Guesses(tips={"f": ("nowhere", (0.0, 0.0, 0.0))}), "no link 'nowhere'"),
        (Guesses(locked_deg={"nothing": 0.0}), "no joint 'nothing' to lock"),
    ],
)
def test_guesses_that_do_not_fit_are_refused(tmp_path, guesses, said):
    with pytest.raises(HandError, match=said):
        import_hand(three_fingers(tmp_path / "own.urdf"), "own", guesses)


def test_a_file_without_fingers_is_refused(tmp_path):
    with pytest.raises(HandError, match=r"has 0 finger\(s\)"):
        import_hand(written(tmp_path / "own.urdf", PALM), "own", Guesses())


def test_the_description_that_is_written_is_the_hand(tmp_path):
    arm = '<link name="base"/><link name="l1"/><link name="l2"/>'
    arm += joint("a1", "base", "l1", "0 0 1") + joint("a2", "l1", "l2", "0 1 0", at="0 0 0.3")
    arm += joint("a3", "l2", "palm", "0 1 0", at="0 0 0.3")
    conf = tmp_path / "conf"
    found = add_hand(three_fingers(tmp_path / "on arm.urdf", arm), None, Guesses(), conf)
    assert found["name"] == "on_arm"
    assert Path(found["picture"]).is_file()
    text = Path(found["description"]).read_text()
    assert text.count("#") > 8
    hand = load_hand(load_config(["hand=on_arm"], conf).hand)
    assert hand.finger_names == tuple(found["used"])
    # The arm stays behind.
    assert not {"base", "l1", "l2"} & {frame.name for frame in hand.model.frames}


@pytest.mark.skipif(NO_MUJOCO, reason="no MuJoCo here (tests/system-tools installs it)")
def test_mjcf_is_read_as_mujoco_means_it(tmp_path):
    import mujoco
    import pinocchio

    path = write_mjcf(
        tmp_path / "small.xml",
        '<equality><joint joint1="f3" joint2="f2" polycoef="0.1 0.5 0 0 0"/></equality>',
    )
    found = import_hand(urdf_of_mjcf(path, "small", tmp_path / "out"), "small", Guesses())
    hand, model = found.hand, mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    assert [each.name for each in hand.followers] == ["f3"]
    joints = hand.lower + 0.3 * (hand.upper - hand.lower)
    values = dict(zip(hand.joint_names, joints, strict=True))
    values |= {each.name: each.ratio * values[each.leader] + each.offset for each in hand.followers}
    for name, value in values.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    known = hand.model.createData()
    pinocchio.framesForwardKinematics(hand.model, known, joints)
    for body in ("f_c", "g_b", "h_c"):
        wanted = data.xpos[model.body(body).id] - data.xpos[model.body("palm").id]
        placed = known.oMf[hand.model.getFrameId(body)].translation
        np.testing.assert_allclose(placed, wanted, atol=1e-9)
    # Bare frames, one a tip and one before each joint beside its body's origin, weigh a gram.
    known_kg = sum(each.mass for each in hand.model.inertias)
    assert known_kg == pytest.approx(float(model.body_mass.sum()) + 6e-3, rel=1e-6)
    assert hand.effort_limits[hand.joint_names.index("f2")] == pytest.approx(1.5)


@pytest.mark.skipif(NO_MUJOCO, reason="no MuJoCo here (tests/system-tools installs it)")
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace("<worldbody>", "<worldbody"), "MuJoCo cannot read"),
        (
            lambda text: text.replace(
                '<joint name="f3" axis="0 -1 0" range="-11 90"/>', '<joint type="ball"/>'
            ),
            "ball",
        ),
        (
            lambda text: text.replace(
                "</mujoco>", '<equality><weld body1="f_c" body2="g_c"/></equality></mujoco>'
            ),
            "closes a loop",
        ),
    ],
)
def test_mjcf_that_cannot_be_used_is_refused(tmp_path, change, said):
    path = write_mjcf(tmp_path / "small.xml")
    path.write_text(change(path.read_text()))
    with pytest.raises(HandError, match=said):
        urdf_of_mjcf(path, "small", tmp_path / "out")


def test_without_mujoco_one_sentence_says_so(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(HandError, match="whose reader is not installed"):
        add_hand(write_mjcf(tmp_path / "small.xml"), None, Guesses(), tmp_path / "conf")


def test_links_without_a_shape_at_the_tip_are_refused(tmp_path):
    body = PALM + fingers(3, lambda n, at: joint(f"{n}1", "palm", f"{n}_a", "0 1 0", **at) + link(f"{n}_a"))
    with pytest.raises(HandError, match="say where its tip is with --tip"):
        import_hand(written(tmp_path / "own.urdf", body), "own", Guesses())
