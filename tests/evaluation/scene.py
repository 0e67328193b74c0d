"""Grasps of the Allegro hand on the bottle that were found once, and small writers of others' formats.

The writers share nothing with the package: transforms are multiplied out here, and joints are listed by hand.
"""

import json
from functools import lru_cache
from pathlib import Path

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from graspbench.config.trial_config import load_config
from graspbench.evaluation.formats.format import FormatContext
from graspbench.evaluation.grasp_record import ContactSet, GraspRecord, HandPose
from graspbench.geometry import load_object
from graspbench.hand import load_hand

DATA = Path(__file__).with_name("allegro_bottle.json")
# The palm frame in palm_link, from the hand's option: 11.1 mm along x, -20 mm along z, turned.
PALM = np.array([[0, 0, 1, 0.0111], [0, -1, 0, 0], [1, 0, 0, -0.02], [0, 0, 0, 1.0]])
# DexGraspBench's root in palm_link: the MJCF's palm is turned by the quaternion (0, 1, 0, 1) in it.
ROOT = np.eye(4)
ROOT[:3, :3] = Rotation.from_quat([1, 0, 1, 0]).as_matrix().T
FINGER_BY_FINGER = [f"joint_{i}.0" for i in range(16)]


@lru_cache(maxsize=2)
def setting(hand="allegro"):
    config = load_config(["record=off", f"hand={hand}", "hand.fingers=4", "object=bottle"])
    return FormatContext(load_hand(config.hand), load_object(config.object))


@lru_cache(maxsize=1)
def known():
    hand = setting().hand
    return tuple(
        GraspRecord(
            hand="allegro",
            joint_names=hand.joint_names,
            object_name="bottle",
            grasp=HandPose(np.array(one["palm"]), np.array(one["joints"])),
            contacts=ContactSet(np.array(one["points"]), np.array(one["normals"])),
        )
        for one in json.loads(DATA.read_text(encoding="utf-8"))
    )


def joint(record, name):
    return float(record.grasp.joints[record.joint_names.index(name)])


def palm_link_in_mesh(record):
    """Pose of palm_link in the frame of the bottle's shape: its centre of mass is above the origin."""
    object_in_mesh = np.linalg.inv(setting().transform_file_to_object(1.0))
    return object_in_mesh @ record.grasp.transform_palm_to_object @ np.linalg.inv(PALM)


def wxyz(transform):
    x, y, z, w = Rotation.from_matrix(transform[:3, :3]).as_quat()
    return [w, x, y, z]


def isaac(path, records, quaternion=wxyz):
    grasps = {}
    for i, record in enumerate(records):
        pose = palm_link_in_mesh(record)
        w, *xyz = map(float, quaternion(pose))
        grasps[f"grasp_{i}"] = {
            "confidence": 0.5,
            "position": pose[:3, 3].tolist(),
            "orientation": {"w": w, "xyz": xyz},
            "cspace_position": {name: joint(record, name) for name in FINGER_BY_FINGER},
            "pregrasp_cspace_position": {name: 0.5 * joint(record, name) for name in FINGER_BY_FINGER},
        }
    path.write_text(yaml.safe_dump({"format": "isaac_grasp", "format_version": 1.0, "grasps": grasps}))
    return path


OBJECT_IN_WORLD = np.eye(4)
OBJECT_IN_WORLD[:3, :3] = Rotation.from_euler("xyz", [0.2, -0.4, 1.0]).as_matrix()
OBJECT_IN_WORLD[:3, 3] = 0.3, -0.1, 0.7


def dexgraspbench(path, records, order=FINGER_BY_FINGER, quaternion=wxyz, metres=1.0, radians=1.0, root=ROOT):
    rows = []
    for record in records:
        pose = OBJECT_IN_WORLD @ palm_link_in_mesh(record) @ root
        joints = [radians * joint(record, name) for name in order]
        rows.append(np.concatenate([metres * pose[:3, 3], quaternion(pose), joints]))
    grasps = [
        {
            "obj_pose": np.concatenate([metres * OBJECT_IN_WORLD[:3, 3], quaternion(OBJECT_IN_WORLD)]),
            "obj_scale": 1.0,
            "obj_path": "bottle",
            "pregrasp_qpos": row,
            "grasp_qpos": row,
            "squeeze_qpos": row,
        }
        for row in rows
    ]
    np.save(path, np.array(grasps, dtype=object), allow_pickle=True)
    return path


def dexgraspnet(path, records, radians=1.0):
    grasps = []
    for record in records:
        pose = palm_link_in_mesh(record)
        r = pose[:3, :3]
        # R = Rz(c) Ry(b) Rx(a), solved by hand.
        angles = np.arctan2(r[2, 1], r[2, 2]), np.arcsin(-r[2, 0]), np.arctan2(r[1, 0], r[0, 0])
        qpos = {f"WRJT{axis}": float(value) for axis, value in zip("xyz", pose[:3, 3], strict=True)}
        qpos |= {f"WRJR{axis}": radians * float(value) for axis, value in zip("xyz", angles, strict=True)}
        qpos |= {name: radians * joint(record, name) for name in FINGER_BY_FINGER}
        grasps.append({"scale": 1.0, "qpos": qpos})
    np.save(path, np.array(grasps, dtype=object), allow_pickle=True)
    return path


def jsonl(path, records):
    lines = []
    for record in records:
        pose = palm_link_in_mesh(record) @ PALM
        lines.append(
            {
                "joint_names": FINGER_BY_FINGER,
                "object_frame": "mesh",
                "grasp": {
                    "palm": {"position": pose[:3, 3].tolist(), "quaternion_wxyz": wxyz(pose)},
                    "joints": [joint(record, name) for name in FINGER_BY_FINGER],
                },
            }
        )
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


WRITERS = {
    "isaac": (isaac, "grasps.yaml"),
    "dexgraspbench": (dexgraspbench, "grasps.npy"),
    "dexgraspnet": (dexgraspnet, "grasps.npy"),
    "jsonl": (jsonl, "grasps.jsonl"),
}
