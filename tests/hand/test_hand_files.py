"""Descriptions of hands: what is found, generated, replaced, and refused."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from graspbench.errors import HandError
from graspbench.hand import (
    CollisionShape,
    FingerDescription,
    GraspChecker,
    HandParameters,
    PalmDescription,
    load_hand,
)
from graspbench.hand.files import in_short_lines, write_urdf
from graspbench.hand.radial import radial_urdf

GRIPPER = """<robot name="gripper">
<link name="base"><collision>
<geometry><box size="0.06 0.06 0.02"/></geometry></collision></link>
{fingers}</robot>"""
FINGER = """
<joint name="{n}1" type="revolute"><parent link="base"/><child link="{n}_low"/>
<origin xyz="{x} {y} 0.01" rpy="0 0 {yaw}"/>
<axis xyz="1 0 0"/><limit lower="-0.8" upper="0.8" effort="1" velocity="1"/></joint>
<link name="{n}_low"><collision>
<origin xyz="0 0 0.04"/><geometry><cylinder radius="0.006" length="0.08"/></geometry></collision></link>
<joint name="{n}2" type="{type}"><parent link="{n}_low"/><child link="{n}_mid"/><origin xyz="0 0 0.0"/>
<axis xyz="0 -1 0"/><limit lower="-1.2" upper="0.8" effort="1" velocity="1"/>{mimic}</joint>
<link name="{n}_mid"/>
<joint name="{n}3" type="revolute"><parent link="{n}_mid"/><child link="{n}_high"/><origin xyz="0 0 0.08"/>
<axis xyz="0 -1 0"/><limit lower="-0.1" upper="1.6" effort="1" velocity="1"/></joint>
<link name="{n}_high"/>
<joint name="{n}_fix" type="fixed"><parent link="{n}_high"/><child link="{n}_tip"/>
<origin xyz="0 0 0.07"/></joint>
<link name="{n}_tip"/>
"""


def write_gripper(folder: Path, **changes: str) -> Path:
    fingers = ""
    for i, n in enumerate("abc"):
        angle = 2 * np.pi * i / 3
        values = {"type": "revolute", "mimic": "", "x": 0.04 * np.cos(angle), "y": 0.04 * np.sin(angle)}
        if n == "c":
            values |= changes
        fingers += FINGER.format(n=n, yaw=angle, **values)
    path = folder / "gripper.urdf"
    path.write_text(GRIPPER.format(fingers=fingers))
    return path


def gripper(folder: Path, **changes: str) -> HandParameters:
    return HandParameters(
        name="gripper",
        kind="urdf",
        fingers=3,
        urdf=str(write_gripper(folder, **changes)),
        palm=PalmDescription(link="base", xyz_m=(0.0, 0.0, 0.01)),
        chains=tuple(FingerDescription(name=n, tip=f"{n}_tip") for n in "abc"),
    )


def test_a_hand_of_one_s_own_grasps(tmp_path):
    hand = load_hand(gripper(tmp_path))
    assert hand.joint_names == ("a1", "a2", "a3", "b1", "b2", "b3", "c1", "c2", "c3")
    angles = 0.3 + 2 * np.pi * np.arange(3) / 3
    normals = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = 0.03 * normals + (0.0, 0.0, 0.06)
    checker = GraspChecker(hand)
    posture = checker.place(points, normals)
    assert posture is not None
    assert checker.verify(posture, points, normals) == ()


def test_tips_without_a_shape_get_their_sphere(tmp_path):
    shapes = load_hand(gripper(tmp_path)).shapes
    tips = shapes.index[:, 3] == 1
    assert tips.sum() == 3
    np.testing.assert_allclose(shapes.size[tips, 3], 0.008)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"urdf": "nowhere.urdf"}, "does not exist"),
        ({"urdf": "package://no-such-package/hand.urdf"}, "install its package"),
        ({"urdf": None}, "has no URDF"),
        ({"fingers": 4}, "has 3 fingers, 4 are asked for"),
        ({"palm": PalmDescription(link="hand")}, "no palm link 'hand'"),
        ({"locked_deg": {"a9": 0.0}}, "no joint 'a9' to lock"),
        ({"package_dirs": ("/no/such/folder",)}, "does not exist"),
        ({"subsets": {3: ("a", "b", "z")}}, "lists a, b, z"),
        ({"collision": {"wrist": ()}}, "no link 'wrist'"),
        ({"collision": {"base": (CollisionShape("box", (0.1,)),)}}, "give 3 positive lengths"),
    ],
)
def test_a_wrong_description_is_refused_in_one_sentence(tmp_path, changes, said):
    with pytest.raises(HandError, match=said) as caught:
        load_hand(replace(gripper(tmp_path), **changes))
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("finger", "said"),
    [
        (FingerDescription("c", "no_tip"), "has no link 'no_tip'"),
        (FingerDescription("c", "base"), "no joint moves the tip"),
        (FingerDescription("c", "b_tip"), "share the joint"),
        (FingerDescription("a", "c_tip"), "two fingers of one name"),
        (FingerDescription("c", "c_tip", joints=("c2", "c3")), "is moved by c1, c2, c3"),
        (FingerDescription("c", "c_tip", posture_deg=(0.0, 0.0, 120.0)), "does not lie within the limits"),
    ],
)
def test_a_wrong_finger_is_refused(tmp_path, finger, said):
    parameters = gripper(tmp_path)
    chains = (*parameters.chains[:2], finger)
    with pytest.raises(HandError, match=said):
        load_hand(replace(parameters, chains=chains))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"type": "continuous"}, "plain joint with limits"),
        ({"mimic": '<mimic joint="nowhere"/>'}, "the joint 'nowhere', which is not there"),
    ],
)
def test_joints_that_are_not_plain_are_refused(tmp_path, changes, said):
    with pytest.raises(HandError, match=said):
        load_hand(gripper(tmp_path, **changes))


def test_an_unreadable_urdf_is_refused(tmp_path):
    parameters = gripper(tmp_path)
    Path(parameters.urdf).write_text("<robot")
    with pytest.raises(HandError, match="cannot be read"):
        load_hand(replace(parameters, name="broken"))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"link_lengths_m": (0.07, 0.05, 0.01)}, "shortest link"),
        ({"link_radius_m": 0.009}, "thicker than its fingertips"),
        ({"posture_deg": (0.0, -80.0, 50.0, 35.0)}, "proximal joint"),
        ({"palm_radius_m": 0.01, "fingers": 5}, "do not fit on a palm"),
    ],
)
def test_an_impossible_radial_hand_is_refused(changes, said):
    with pytest.raises(HandError, match=said):
        radial_urdf(HandParameters(**changes))


def test_a_file_is_named_after_its_content(tmp_path):
    first = write_urdf("<robot name='a'/>", "hand", tmp_path)
    assert write_urdf("<robot name='a'/>", "hand", tmp_path) == first
    assert write_urdf("<robot name='b'/>", "hand", tmp_path) != first
    first.write_text("cut")
    assert write_urdf("<robot name='a'/>", "hand", tmp_path).read_text() == "<robot name='a'/>"
    assert len(list(tmp_path.iterdir())) == 2


def test_collision_shapes_are_replaced(allegro):
    links = {link.get("name"): link for link in ElementTree.parse(allegro.urdf_path).getroot().iter("link")}
    kinds = [next(iter(c.find("geometry"))).tag for c in links["link_3.0"].findall("collision")]
    assert kinds == ["box", "cylinder"]
    for mesh in ElementTree.parse(allegro.urdf_path).getroot().iter("mesh"):
        assert Path(mesh.get("filename")).is_file()


def test_long_lines_are_broken_between_tags_only():
    short = "<robot>\n<link name='a'/></robot>"
    assert in_short_lines(short) == short
    links = "".join(f'<link name="link_{k}" />' for k in range(1000))
    broken = in_short_lines(f"<robot>{links}</robot>")
    assert max(len(line) for line in broken.split("\n")) < 100
    assert broken.replace("\n", "") == f"<robot>{links}</robot>"
