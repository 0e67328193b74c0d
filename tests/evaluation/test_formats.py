import json
from dataclasses import replace

import numpy as np
import pinocchio
import pytest
import yaml

from graspbench.errors import HandError
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FORMATS, format_of, read_grasps, write_grasps
from graspbench.evaluation.formats.hand_layout import hand_layout
from graspbench.evaluation.grasp_record import GraspRecord, HandPose
from graspbench.hand.parameters import FileFrame
from tests.evaluation.scene import (
    FINGER_BY_FINGER,
    OBJECT_IN_WORLD,
    WRITERS,
    dexgraspbench,
    isaac,
    known,
    palm_link_in_mesh,
    setting,
)

CLOSE = {"rtol": 0.0, "atol": 1e-9}


def same(first, second):
    np.testing.assert_allclose(first.transform_palm_to_object, second.transform_palm_to_object, **CLOSE)
    np.testing.assert_allclose(first.joints, second.joints, **CLOSE)


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_of_an_independent_writer_is_read_as_it_was_meant(name, tmp_path):
    write, file = WRITERS[name]
    path = write(tmp_path / file, known())
    assert format_of(path) == name
    for meant, read in zip(known(), read_grasps(path, setting()), strict=True):
        same(meant.grasp, read.grasp)


def test_forward_kinematics_from_the_numbers_of_a_file_reach_the_contacts(tmp_path):
    # What stands in the file, put into Pinocchio's own kinematics of the description.
    content = yaml.safe_load(isaac(tmp_path / "g.yaml", known()).read_text())
    hand = setting().hand
    data = hand.model.createData()
    for grasp, record in zip(content["grasps"].values(), known(), strict=True):
        q = pinocchio.neutral(hand.model)
        for name, value in grasp["cspace_position"].items():
            q[hand.model.joints[hand.model.getJointId(name)].idx_q] = value
        pinocchio.framesForwardKinematics(hand.model, data, q)
        turn = grasp["orientation"]
        rotation = pinocchio.Quaternion(turn["w"], *turn["xyz"]).toRotationMatrix()
        tips = [data.oMf[hand.model.getFrameId(f"link_{i}.0_tip")].translation for i in (15, 3, 7, 11)]
        at = np.array(tips) @ rotation.T + grasp["position"]
        to_mesh = np.linalg.inv(setting().transform_file_to_object(1.0))
        points = record.contacts.points @ to_mesh[:3, :3].T + to_mesh[:3, 3]
        gaps = np.linalg.norm(at[:, None] - points, axis=2).min(axis=0)
        np.testing.assert_allclose(gaps, 0.012, atol=2e-4)  # the tips' radius


def everything(record):
    generator = np.random.default_rng(3)

    def pose():
        joints = generator.uniform(setting().hand.lower, setting().hand.upper)
        return HandPose(record.grasp.transform_palm_to_object, joints)

    return replace(
        record,
        pregrasp=pose(),
        squeeze=pose(),
        approach=(pose(), pose()),
        confidence=0.25,
        source="somebody",
        object_scale=0.125,
        transform_object_to_world=OBJECT_IN_WORLD,
    )


@pytest.mark.parametrize("name", FORMATS.names())
def test_round_trip(name, tmp_path):
    records = [everything(record) for record in known()]
    path = tmp_path / f"grasps{FORMATS[name].suffixes[0]}"
    write_grasps(path, records, setting(), name)
    scale = 1.0 if name == "isaac" else 0.125  # isaac's files do not say at which scale
    for meant, read in zip(records, read_grasps(path, replace(setting(), object_scale=1.0)), strict=True):
        shift = setting().transform_file_to_object(scale) @ np.linalg.inv(
            setting().transform_file_to_object(0.125)
        )
        back = np.linalg.inv(shift) @ read.grasp.transform_palm_to_object
        np.testing.assert_allclose(back, meant.grasp.transform_palm_to_object, **CLOSE)
        np.testing.assert_allclose(read.grasp.joints, meant.grasp.joints, **CLOSE)
        if name in ("jsonl", "parquet", "dexgraspbench"):
            same(read.pregrasp, meant.pregrasp)
            same(read.squeeze, meant.squeeze)
            assert len(read.approach) == 2
            np.testing.assert_allclose(read.transform_object_to_world, OBJECT_IN_WORLD, **CLOSE)
        if name in ("jsonl", "parquet"):
            np.testing.assert_allclose(read.contacts.points, meant.contacts.points, **CLOSE)
            assert (read.confidence, read.source) == (0.25, "somebody")


def test_rows_of_many_grasps_and_split_poses_of_dexgraspbench(tmp_path):
    whole = read_grasps(dexgraspbench(tmp_path / "a.npy", known()), setting())
    content = np.load(tmp_path / "a.npy", allow_pickle=True)
    rows = np.stack([each["grasp_qpos"] for each in content])
    stacked = {"obj_pose": content[0]["obj_pose"], "obj_scale": 1.0, "grasp_qpos": rows}
    np.save(tmp_path / "b.npy", np.array(stacked, dtype=object), allow_pickle=True)
    split = {"obj_pose": stacked["obj_pose"], "grasp_pose": rows[0, :7], "grasp_qpos": rows[0, 7:]}
    np.save(tmp_path / "c.npy", np.array(split, dtype=object), allow_pickle=True)
    for meant, read in zip(whole, read_grasps(tmp_path / "b.npy", setting()), strict=True):
        same(meant.grasp, read.grasp)
    same(whole[0].grasp, read_grasps(tmp_path / "c.npy", setting())[0].grasp)


def test_contacts_alone_are_a_grasp_of_ours_and_of_nobody_else(tmp_path):
    alone = GraspRecord("allegro", (), "bottle", contacts=known()[0].contacts)
    write_grasps(tmp_path / "g.parquet", [alone], setting(), "parquet")
    read = read_grasps(tmp_path / "g.parquet", setting())[0]
    assert read.grasp is None
    np.testing.assert_allclose(read.contacts.normals, alone.contacts.normals, **CLOSE)
    with pytest.raises(GraspFileError, match="contacts alone cannot be written as isaac"):
        write_grasps(tmp_path / "g.yaml", [alone], setting(), "isaac")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"joint_names": ["joint_0.0"]}, "lacks 'joint_1.0'"),
        ({"joint_names": [*FINGER_BY_FINGER[:-1], "elbow"]}, "no joint 'elbow'"),
        (
            {"grasp": {"palm": {"position": [0, 0, 0], "quaternion_wxyz": [1, 0, 0, 1]}, "joints": [0] * 16}},
            "norm 1.41",
        ),
        (
            {"grasp": {"palm": {"position": [0, 0], "quaternion_wxyz": [1, 0, 0, 0]}, "joints": [0] * 16}},
            "position",
        ),
        (
            {
                "grasp": {
                    "palm": {"position": [0, 0, 0], "quaternion_wxyz": [1, 0, 0, 0]},
                    "joints": ["a"] * 16,
                }
            },
            "joints of grasp",
        ),
        ({"grasp": None}, "neither a grasp nor contacts"),
        ({"object_frame": "moon"}, "object_frame"),
        ({"schema": 9}, "schema 9"),
        ({"contacts": [{"point": [0, 0, 0], "normal": [0, 0, 0]}]}, "contact 0 is zero"),
    ],
)
def test_what_is_wrong_in_our_own_files_is_said_with_its_line(change, words, tmp_path):
    write, file = WRITERS["jsonl"]
    path = write(tmp_path / file, known()[:1])
    line = json.loads(path.read_text())
    path.write_text("\n" + json.dumps(line | change))
    with pytest.raises(GraspFileError, match="line 2") as caught:
        read_grasps(path, setting())
    assert words in str(caught.value)


def test_a_joint_that_the_hand_has_not_is_named(tmp_path):
    path = isaac(tmp_path / "g.yaml", known()[:1])
    path.write_text(path.read_text().replace("joint_9.0", "finger_9"))
    with pytest.raises(GraspFileError, match=r"grasp_0.*joint_9\.0"):
        read_grasps(path, setting())


def test_a_folder_is_a_set_and_what_is_no_grasp_file_is_said(tmp_path):
    isaac(tmp_path / "a.yaml", known()[:2])
    dexgraspbench(tmp_path / "b.npy", known()[2:])
    assert len(read_grasps(tmp_path, setting())) == len(known())
    np.save(tmp_path / "c.npy", np.eye(3))
    with pytest.raises(GraspFileError, match="no known format"):
        read_grasps(tmp_path / "c.npy", setting())
    with pytest.raises(GraspFileError, match="no file"):
        read_grasps(tmp_path / "missing.npy", setting())


def test_a_layout_of_a_moving_link_or_of_a_joint_twice_is_refused():
    hand = setting().hand
    for frame, words in (
        (FileFrame(link="link_1.0"), "moves it"),
        (FileFrame(link="elbow"), "no such link"),
        (FileFrame(joints={"a": "joint_0.0", "b": "joint_0.0"}), "twice"),
        (FileFrame(joints={"a": "elbow"}), "elbow"),
    ):
        with pytest.raises(HandError, match=words):
            hand_layout(replace(hand, file_frames={"isaac": frame}), "isaac")


def test_the_writers_frame_is_the_link_that_they_say():
    # The writer's own arithmetic agrees with the description: palm_link is the root of the URDF.
    link = palm_link_in_mesh(known()[0])
    palm = link @ setting().hand.transform_palm_to_root
    back = setting().transform_file_to_object(1.0) @ palm
    np.testing.assert_allclose(back, known()[0].grasp.transform_palm_to_object, **CLOSE)
