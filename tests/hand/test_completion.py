"""What published descriptions leave out is filled in, alike for the planners and for the simulation."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pinocchio
import pytest
import trimesh

from graspbench.errors import HandError
from graspbench.geometry import ObjectParameters, load_object
from graspbench.hand import FingerDescription, HandParameters, PalmDescription, load_hand
from graspbench.simulation import SceneParameters, World
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.mounts.floating import FloatingWrist
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.tip_friction import TipFriction

INERTIAL = """<inertial><mass value="{mass}"/>
<inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>"""
LOW = """<collision><origin xyz="0 0 0.035"/>
<geometry><cylinder radius="0.006" length="0.07"/></geometry></collision>"""
FINGER = """
<joint name="{n}1" type="revolute"><origin xyz="{x} {y} 0" rpy="0 0 {yaw}"/>
<parent link="palm"/><child link="{n}_a"/>
<axis xyz="{sideways}"/><limit lower="-1.5" upper="1.5" effort="{effort}" velocity="{velocity}"/></joint>
<link name="{n}_a">{inertial}</link>
<joint name="{n}2" type="revolute"><parent link="{n}_a"/><child link="{n}_b"/>
<axis xyz="0 1 0"/><limit lower="-1.5" upper="1.5" effort="{effort}" velocity="{velocity}"/></joint>
<link name="{n}_b">{inertial}{visual}{low}</link>
<joint name="{n}3" type="revolute"><origin xyz="0 0 0.07"/><parent link="{n}_b"/><child link="{n}_c"/>
<axis xyz="0 1 0"/><limit lower="-1.5" upper="1.5" effort="{effort}" velocity="{velocity}"/></joint>
<link name="{n}_c">{inertial}<collision><origin xyz="0 0 0.0275"/>
<geometry><cylinder radius="0.006" length="0.055"/></geometry></collision></link>"""
HAND = """<robot name="own">{above}<link name="palm">{inertial}<collision><origin xyz="0 0 -0.01"/>
<geometry><cylinder radius="0.05" length="0.02"/></geometry></collision></link>{fingers}</robot>"""
WRIST = """<link name="arm"/><joint name="wrist" type="revolute"><origin xyz="0 0 0.1" rpy="0.2 0 0"/>
<parent link="arm"/><child link="palm"/><axis xyz="0 1 0"/>
<limit lower="0.1" upper="1.5" effort="1" velocity="1"/></joint>"""


def write_hand(path, **changes):
    """Write a hand of three fingers with three joints each, its tips bare, 55 mm along the last links."""
    values = {
        "effort": "3", "velocity": "4", "visual": "", "low": LOW, "sideways": "1 0 0", "above": "",
        "inertial": INERTIAL.format(mass=0.03, i=1e-5), **changes,
    }  # fmt: skip
    fingers = ""
    for k in range(3):
        angle = 2 * np.pi * k / 3
        place = {"x": 0.05 * np.cos(angle), "y": 0.05 * np.sin(angle), "yaw": angle}
        fingers += FINGER.format(n="fgh"[k], **place, **values)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(HAND.format(fingers=fingers, **values))
    return path


def own_hand(urdf, **changes):
    fingers = tuple(
        FingerDescription(n, f"{n}_c", tip_xyz_m=(0.0, 0.0, 0.055), posture_deg=(0.0, 20.0, -50.0))
        for n in "fgh"
    )
    parameters = HandParameters(
        name="own", kind="urdf", urdf=str(urdf), palm=PalmDescription("palm"), chains=fingers
    )
    return load_hand(replace(parameters, **changes))


def simulated(hand, world):
    wrist = FloatingWrist(hand, np.diag([1.0, -1.0, -1.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    return SimulatedHand(world, hand, wrist, hand.preferred, TipFriction(0.5, 0.0, 0.5))


@pytest.fixture
def world():
    with World(load_object(ObjectParameters(name="cylinder")), SceneParameters(), 0) as world:
        yield world


@pytest.mark.parametrize(
    ("inertial", "link_kg"),
    [
        ("", 1500 * np.pi * 0.006**2 * 0.055),
        (INERTIAL.format(mass=0, i=0), 1500 * np.pi * 0.006**2 * 0.055),
        (INERTIAL.format(mass=0.05, i=0), 0.05),
        (INERTIAL.format(mass=0.03, i=1e-5), 0.03),
    ],
)
def test_masses_are_alike_in_both_and_stated_where_the_file_says_nothing(tmp_path, world, inertial, link_kg):
    hand = own_hand(write_hand(tmp_path / "own.urdf", inertial=inertial))
    body = simulated(hand, world)
    names, masses, moments = {}, {}, {}
    for link in range(pybullet.getNumJoints(body.body, physicsClientId=world.client)):
        name = pybullet.getJointInfo(body.body, link, physicsClientId=world.client)[12].decode()
        dynamics = pybullet.getDynamicsInfo(body.body, link, physicsClientId=world.client)
        names[name], masses[name], moments[name] = link, dynamics[0], dynamics[2]
    assert masses["f_c"] == pytest.approx(link_kg)
    assert min(moments["f_c"]) > 0.0
    in_file = ElementTree.parse(hand.urdf_path).getroot()
    for link in in_file.findall("link"):
        stated = float(link.find("inertial/mass").get("value"))
        assert masses[link.get("name")] == pytest.approx(stated, rel=1e-6)
    moving = sum(inertia.mass for inertia in hand.model.inertias[1:])
    fingers = [m for name, m in masses.items() if name[:2] in ("f_", "g_", "h_")]
    assert moving == pytest.approx(sum(fingers), rel=1e-6)


def test_a_box_and_its_mesh_weigh_the_same(tmp_path):
    mesh = trimesh.creation.box((0.02, 0.01, 0.06))
    mesh.apply_translation((0, 0, 0.03))
    mesh.export(tmp_path / "box.stl")
    shapes = (
        '<box size="0.02 0.01 0.06"/></geometry><origin xyz="0 0 0.03"/>',
        '<mesh filename="box.stl"/></geometry>',
        '<mesh filename="box.stl" scale="0.5 0.5 0.5"/></geometry>',
    )
    found = []
    for k, shape in enumerate(shapes):
        low = f"<collision><geometry>{shape}</collision>"
        hand = own_hand(write_hand(tmp_path / f"{k}.urdf", inertial="", low=low))
        found.append(hand.model.inertias[2])
    assert found[0].mass == pytest.approx(1500 * 0.02 * 0.01 * 0.06)
    np.testing.assert_allclose(found[0].lever, [0, 0, 0.03], atol=1e-12)
    np.testing.assert_allclose(found[1].matrix(), found[0].matrix(), rtol=1e-5, atol=1e-9)
    assert found[2].mass == pytest.approx(found[0].mass / 8)


def test_limits_of_zero_are_not_given(tmp_path):
    hand = own_hand(write_hand(tmp_path / "own.urdf", effort="0", velocity="0"), effort_limit_nm=1.25)
    np.testing.assert_allclose(hand.effort_limits, 1.25)
    np.testing.assert_allclose(np.degrees(hand.velocity_limits), 180.0)
    given = own_hand(write_hand(tmp_path / "given.urdf"))
    np.testing.assert_allclose(given.effort_limits, 3.0)
    np.testing.assert_allclose(given.velocity_limits, 4.0)
    with pytest.raises(HandError, match="joint 'f1' of hand 'own' has 'much' as 'effort'"):
        own_hand(write_hand(tmp_path / "bad.urdf", effort="much"))


def test_bare_tips_with_an_offset_are_spheres_in_both(tmp_path, world):
    hand = own_hand(write_hand(tmp_path / "own.urdf"), tip_radius_m=0.009)
    tips = hand.tip_positions(hand.preferred)
    body = simulated(hand, world)
    palm = body.palm_pose()
    in_palm = (body.tip_poses(range(3))[:, :3, 3] - palm[:3, 3]) @ palm[:3, :3]
    np.testing.assert_allclose(in_palm, tips, atol=1e-5)
    straight = own_hand(write_hand(tmp_path / "own.urdf")).tip_positions(np.zeros(9))
    np.testing.assert_allclose(straight[:, 2], 0.07 + 0.055, atol=1e-12)
    for f, link in enumerate(hand.tip_links):
        index = body._tip_ids[f]
        shapes = pybullet.getCollisionShapeData(body.body, index, physicsClientId=world.client)
        assert [shape[2] for shape in shapes] == [pybullet.GEOM_SPHERE], link
        assert shapes[0][3][0] == pytest.approx(0.009)


def test_what_is_only_seen_does_not_matter(tmp_path, world):
    (tmp_path / "broken.stl").write_text("nothing")
    for file in ("package://gone/link.glb", "broken.stl", "missing.dae"):
        visual = f'<visual><geometry><mesh filename="{file}"/></geometry></visual>'
        simulated(own_hand(write_hand(tmp_path / "own.urdf", visual=visual)), world)


@pytest.mark.parametrize("file", ["package://own_desc/meshes/link.stl", "../meshes/link.stl"])
def test_meshes_of_the_usual_layout_are_found(tmp_path, file):
    low = f'<collision><geometry><mesh filename="{file}"/></geometry></collision>'
    urdf = write_hand(tmp_path / "own_desc" / "urdf" / "own.urdf", low=low)
    with pytest.raises(HandError, match="is not found") as caught:
        own_hand(urdf)
    assert ("hand.package_dirs" in str(caught.value)) == file.startswith("package")
    (tmp_path / "own_desc" / "meshes").mkdir()
    trimesh.creation.cylinder(0.006, 0.07).export(tmp_path / "own_desc" / "meshes" / "link.stl")
    assert own_hand(urdf).n_fingers == 3
    # Another load: what is found is remembered with the hand's description.
    (tmp_path / "elsewhere").mkdir()
    moved = write_hand(
        tmp_path / "elsewhere" / "own.urdf", low=low.replace("../meshes", "../own_desc/meshes")
    )
    assert own_hand(moved, package_dirs=(str(tmp_path),)).n_fingers == 3


def test_an_unreadable_collision_mesh_is_named(tmp_path):
    (tmp_path / "broken.stl").write_text("nothing")
    low = '<collision><geometry><mesh filename="broken.stl"/></geometry></collision>'
    with pytest.raises(HandError, match=r"broken\.stl") as caught:
        own_hand(write_hand(tmp_path / "own.urdf", low=low))
    assert "\n" not in str(caught.value)


def test_a_wrist_is_held_where_it_is_told_or_at_its_limit(tmp_path):
    path = write_hand(tmp_path / "own.urdf", above=WRIST)
    for locked, angle in (({}, 0.1), ({"wrist": 45.0}, np.pi / 4)):
        hand = own_hand(path, locked_deg=locked)
        assert "wrist" not in hand.joint_names
        wanted = pinocchio.rpy.rpyToMatrix(0.2, 0.0, 0.0) @ pinocchio.rpy.rpyToMatrix(0.0, angle, 0.0)
        np.testing.assert_allclose(hand.transform_palm_to_root[:3, :3], wanted, atol=1e-9)
        np.testing.assert_allclose(hand.transform_palm_to_root[:3, 3], [0, 0, 0.1], atol=1e-12)


def test_a_joint_follows_another(tmp_path):
    path = write_hand(tmp_path / "own.urdf")
    text = path.read_text().replace(
        '<joint name="f3" type="revolute">',
        '<joint name="f3" type="revolute"><mimic joint="f2" multiplier="0.5" offset="0.1"/>',
    )
    path.write_text(text)
    hand = own_hand(path)
    assert [(each.name, each.leader, each.ratio, each.offset) for each in hand.followers] == [
        ("f3", "f2", 0.5, 0.1)
    ]
    assert "f3" not in hand.joint_names
    assert hand.freedom.tolist() == [2, 3, 3]


@pytest.mark.parametrize(
    ("mimic", "said"),
    [
        ('<mimic joint="f3"/>', "follows \\(mimic\\) the joint 'f3', and so itself"),
        ('<mimic joint="nobody"/>', "the joint 'nobody', which is not there"),
        ('<mimic joint="f2" multiplier="0"/>', "with the multiplier 0"),
        ('<mimic joint="f2" offset="nan"/>', "has 'nan' as 'offset' of its 'mimic'"),
    ],
)
def test_a_joint_that_cannot_follow_gets_one_sentence(tmp_path, mimic, said):
    path = write_hand(tmp_path / "own.urdf")
    path.write_text(
        path.read_text().replace(
            '<joint name="f3" type="revolute">', f'<joint name="f3" type="revolute">{mimic}'
        )
    )
    with pytest.raises(HandError, match=said):
        own_hand(path)


def test_three_parallel_joints_move_a_tip_in_a_plane(tmp_path):
    hand = own_hand(write_hand(tmp_path / "own.urdf", sideways="0 1 0"))
    assert hand.freedom.tolist() == [2, 2, 2]
    assert hand.places_by_wrist


def test_what_is_seen_is_touched_where_nothing_else_could_be(tmp_path):
    """Some published files have shapes to be seen only; others leave them out of what collides on purpose."""
    whole = write_hand(tmp_path / "whole.urdf")
    seen = tmp_path / "seen.urdf"
    seen.write_text(whole.read_text().replace("collision>", "visual>"))
    both = tmp_path / "both.urdf"
    both.write_text(whole.read_text().replace(LOW, LOW.replace("collision>", "visual>")))
    sizes = [len(own_hand(path).geometry.geometryObjects) for path in (whole, seen, both)]
    assert sizes[1] == sizes[0]
    assert sizes[2] == sizes[0] - 3
    shapes = [
        [(item.name, item.placement) for item in own_hand(path).geometry.geometryObjects]
        for path in (whole, seen)
    ]
    assert shapes[0] == shapes[1]
