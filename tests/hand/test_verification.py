"""The independent check sees every planted fault."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from graspbench.hand import GraspChecker, Margins
from graspbench.hand.verification import verify_posture


@pytest.fixture
def grasp(radial):
    angle = 2 * np.pi * np.arange(3) / 3
    normals = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    points = 0.03 * normals + (0.0, 0.0, 0.06)
    posture = GraspChecker(radial).place(points, normals)
    assert posture is not None
    assert verify_posture(radial, posture, points, normals) == ()
    return posture, points, normals


def test_a_displaced_tip(radial, grasp):
    posture, points, normals = grasp
    points = points.copy()
    points[0, 2] += 2e-4
    found = verify_posture(radial, posture, points, normals)
    assert len(found) == 1
    assert "finger_0" in found[0]
    assert "0.20 mm from its place" in found[0]


def test_a_joint_outside_its_limits(radial, grasp):
    posture, points, normals = grasp
    joints = posture.joints.copy()
    joints[2] = radial.upper[2] + 1e-3
    found = verify_posture(radial, replace(posture, joints=joints), points, normals)
    assert "joint 'finger_0_middle' is outside its limits" in found


def test_a_singular_value_below_its_threshold(radial, grasp):
    posture, points, normals = grasp
    found = verify_posture(radial, posture, points, normals, margins=Margins(singular_value_m=0.06))
    assert len(found) == 3
    assert all("singularity" in clause for clause in found)


def test_a_hand_in_the_ground(radial, grasp):
    posture, points, normals = grasp
    tips_low = float(points[0, 2]) - radial.tip_radius_m
    assert verify_posture(radial, posture, points, normals, ground_height_m=tips_low) == ()
    found = verify_posture(radial, posture, points, normals, ground_height_m=tips_low + 1e-3)
    assert len(found) == 3
    assert all("1.00 mm in the ground" in clause for clause in found)
    assert verify_posture(radial, posture, points, normals, ground_height_m=None) == ()


def test_fingers_through_each_other(radial, grasp):
    posture, points, normals = grasp
    joints = posture.joints.copy()
    joints[radial.finger_joints(0)] = (0.0, 0.6, 0.3, 0.2)
    joints[radial.finger_joints(1)] = (0.0, 0.6, 0.3, 0.2)
    found = verify_posture(radial, replace(posture, joints=joints), points, normals)
    assert any("overlap by" in clause for clause in found)


@pytest.mark.parametrize(("radius", "hits"), [(0.0300, 0), (0.0306, 3)])
def test_an_object_that_is_thicker_than_thought(radial, grasp, radius, hits):
    posture, points, normals = grasp
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    mesh.apply_translation((0.0, 0.0, 0.06))
    found = verify_posture(radial, posture, points, normals, object_mesh=mesh)
    assert len([clause for clause in found if "in the object" in clause]) == hits


def test_a_palm_swallowed_by_the_object(radial, grasp):
    posture, points, normals = grasp
    mesh = trimesh.creation.box((1.0, 1.0, 1.0))
    found = verify_posture(radial, posture, points, normals, object_mesh=mesh)
    assert any(clause.startswith("palm") for clause in found)
