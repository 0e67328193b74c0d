"""The wrist's coordinates and the mounted URDF."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from graspbench.hand import HandParameters, load_hand
from graspbench.simulation.mounts.floating import WRIST_JOINTS, mounted_urdf, wrist_coordinates, wrist_pose


@given(st.integers(0, 2**32 - 1))
def test_coordinates_and_pose_are_inverse(seed):
    generator = np.random.default_rng(seed)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(generator.normal(size=4)).as_matrix()
    pose[:3, 3] = generator.normal(size=3)
    np.testing.assert_allclose(wrist_pose(wrist_coordinates(pose)), pose, atol=1e-12)


@pytest.mark.parametrize("second", [np.pi / 2, -np.pi / 2])
def test_gimbal_lock_still_gives_the_pose(second):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("XYZ", [0.3, second, -0.7]).as_matrix()
    np.testing.assert_allclose(wrist_pose(wrist_coordinates(pose)), pose, atol=1e-7)


def test_tilt_about_the_first_axis_is_one_coordinate():
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([2.5, 0, 0]).as_matrix()
    np.testing.assert_allclose(wrist_coordinates(pose), [0, 0, 0, 2.5, 0, 0], atol=1e-12)


def test_mounted_hand_keeps_every_part_and_gains_the_wrist():
    hand = load_hand(HandParameters(fingers=3))
    before = ElementTree.parse(hand.urdf_path).getroot()
    after = ElementTree.fromstring(mounted_urdf(hand, np.eye(3)))
    names = [link.get("name") for link in after.findall("link")]
    assert set(names) >= {link.get("name") for link in before.findall("link")}
    assert len(names) == len(set(names)) == len(before.findall("link")) + 7
    assert [j.get("name") for j in after.findall("joint")][:6] == list(WRIST_JOINTS)
    children = [j.find("child").get("link") for j in after.findall("joint")]
    assert set(names) - set(children) == {"wrist_base"}
