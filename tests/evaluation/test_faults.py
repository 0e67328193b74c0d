"""Files that are wrong in the usual ways are found out by evidence, and right ones are not."""

from dataclasses import replace

import numpy as np
import pytest

from graspbench.evaluation.faults import find_fault, refuse_fault
from graspbench.evaluation.formats.format import read_grasps
from graspbench.evaluation.grasp_record import HandPose
from graspbench.evaluation.other_readings import combined_reading
from tests.evaluation.scene import (
    FINGER_BY_FINGER,
    WRITERS,
    dexgraspbench,
    dexgraspnet,
    isaac,
    known,
    setting,
    wxyz,
)

THUMB_FIRST = FINGER_BY_FINGER[12:] + FINGER_BY_FINGER[:12]
BY_NAME = sorted(FINGER_BY_FINGER)


def xyzw(transform):
    w, *xyz = wxyz(transform)
    return [*xyz, w]


def fault_of(path, name, context=None):
    context = setting() if context is None else context
    return find_fault(path, read_grasps(path, context), context, name)


PLANTED = {
    "xyzw": (dexgraspbench, {"quaternion": xyzw}, ("xyzw",)),
    "degrees": (dexgraspbench, {"radians": 180 / np.pi}, ("degrees",)),
    "millimetres": (dexgraspbench, {"metres": 1000.0}, ("millimetres",)),
    "all three": (
        dexgraspbench,
        {"quaternion": xyzw, "radians": 180 / np.pi, "metres": 1000.0},
        ("xyzw", "degrees", "millimetres"),
    ),
    "thumb first": (dexgraspbench, {"order": THUMB_FIRST}, ("joint_order",)),
    "sorted by name": (dexgraspbench, {"order": BY_NAME}, ("joint_order",)),
    "tip to palm": (dexgraspbench, {"order": FINGER_BY_FINGER[::-1]}, ("joint_order",)),
    "thumb first in millimetres": (
        dexgraspbench,
        {"order": THUMB_FIRST, "metres": 1000.0},
        ("millimetres", "joint_order"),
    ),
    "sorted by name in degrees": (
        dexgraspbench,
        {"order": BY_NAME, "radians": 180 / np.pi},
        ("degrees", "joint_order"),
    ),
    "tip to palm, xyzw, degrees": (
        dexgraspbench,
        {"order": FINGER_BY_FINGER[::-1], "quaternion": xyzw, "radians": 180 / np.pi},
        ("xyzw", "degrees", "joint_order"),
    ),
    "degrees and xyzw": (
        dexgraspbench,
        {"quaternion": xyzw, "radians": 180 / np.pi},
        ("xyzw", "degrees"),
    ),
    "isaac xyzw": (isaac, {"quaternion": xyzw}, ("xyzw",)),
    "dexgraspnet degrees": (dexgraspnet, {"radians": 180 / np.pi}, ("degrees",)),
}


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_fault_is_found_and_named(name, tmp_path):
    write, how, kinds = PLANTED[name]
    path = write(tmp_path / ("g.yaml" if write is isaac else "g.npy"), known(), **how)
    fault = fault_of(path, write.__name__)
    assert fault is not None
    assert fault.kinds == kinds
    assert fault.as_meant_m < 1e-3 < fault.as_read_m
    assert str(path) in fault.sentence


@pytest.mark.parametrize("name", WRITERS)
def test_a_right_file_has_no_fault(name, tmp_path):
    write, file = WRITERS[name]
    assert fault_of(write(tmp_path / file, known()), name) is None


def mirrored():
    """Grasps of the left hand on the mirrored place of the bottle, which is round."""
    left = []
    for record in known():
        # Mirrored in the plane y = 0 of the bottle; the hand in its own plane y = 0.
        flip = np.diag([1.0, -1.0, 1.0, 1.0])
        joints = record.grasp.joints.copy()
        sideways = [record.joint_names.index(f"joint_{i}.0") for i in (0, 4, 8)]
        joints[sideways] *= -1.0
        left.append(
            replace(record, grasp=HandPose(flip @ record.grasp.transform_palm_to_object @ flip, joints))
        )
    return left


def test_a_file_of_the_other_hand_is_found_out(tmp_path):
    path = dexgraspbench(tmp_path / "g.npy", mirrored())
    other = setting("allegro_left")
    assert fault_of(path, "dexgraspbench", other) is None
    fault = fault_of(path, "dexgraspbench")
    assert fault.kinds == ("mirrored_hand",)
    assert "mirrored hand" in fault.sentence


@pytest.mark.parametrize(
    ("how", "kinds"),
    [
        ({"order": THUMB_FIRST}, ("joint_order", "mirrored_hand")),
        ({"metres": 1000.0}, ("millimetres", "mirrored_hand")),
        ({"radians": 180 / np.pi, "order": THUMB_FIRST}, ("degrees", "joint_order", "mirrored_hand")),
    ],
)
def test_the_other_hand_and_what_else_is_wrong_are_found_out_together(how, kinds, tmp_path):
    fault = fault_of(dexgraspbench(tmp_path / "g.npy", mirrored(), **how), "dexgraspbench")
    assert fault.kinds == kinds
    assert fault.as_meant_m < 1e-3 < fault.as_read_m
    error = refuse_fault(fault, "dexgraspbench")
    assert "choose the other hand with --hand" in str(error.remedy)
    assert ("hand.formats.dexgraspbench.joints" in str(error.remedy)) == ("joint_order" in kinds)


def test_bad_grasps_are_no_fault(tmp_path):
    """Grasps that are off in no way that a writer errs in are bad grasps, and are judged so."""
    generator = np.random.default_rng(0)
    hand, bad = setting().hand, []
    for record in known():
        moved = record.grasp.transform_palm_to_object.copy()
        moved[:3, 3] += generator.normal(0.0, 0.02, 3)
        joints = np.clip(record.grasp.joints + generator.normal(0.0, 0.15, 16), hand.lower, hand.upper)
        bad.append(replace(record, grasp=HandPose(moved, joints)))
    assert fault_of(dexgraspbench(tmp_path / "g.npy", bad), "dexgraspbench") is None


def test_a_file_is_read_as_it_is_said_to_be_meant(tmp_path):
    path = dexgraspbench(tmp_path / "g.npy", known(), quaternion=xyzw, radians=180 / np.pi)
    context = replace(setting(), reading=combined_reading(["xyzw", "degrees"]))
    for meant, read in zip(known(), read_grasps(path, context), strict=True):
        np.testing.assert_allclose(read.grasp.joints, meant.grasp.joints, rtol=0, atol=1e-9)
        np.testing.assert_allclose(
            read.grasp.transform_palm_to_object, meant.grasp.transform_palm_to_object, rtol=0, atol=1e-9
        )
