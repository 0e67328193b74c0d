"""Files of grasps that an attacker made, or that are damaged: one sentence, and neither time nor memory."""

import io
import json
import os
import pickle
from functools import lru_cache

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from graspbench.config.trial_config import load_config
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FORMATS, FormatContext, read_grasps
from graspbench.evaluation.formats.parquet import schema
from graspbench.geometry import load_object
from graspbench.hand import load_hand
from tests.fuzz import Budget

ISAAC = "format: isaac_grasp\nformat_version: {version}\ngrasps:\n  g:\n    confidence: {confidence}\n"
ISAAC += "    position: [0, 0, 0]\n    orientation: {{w: 1, xyz: [0, 0, 0]}}\n    cspace_position: {joints}\n"
BOMB = "".join(f"b{i}: &b{i} [" + f"*b{i - 1}, " * 9 * (i > 0) + "1]\n" for i in range(12))


@lru_cache(maxsize=1)
def context():
    config = load_config(["hand=radial", "object=sphere"])
    return FormatContext(load_hand(config.hand), load_object(config.object))


def isaac(version="1.0", confidence="1.0", joints="{}", before=""):
    return (before + ISAAC.format(version=version, confidence=confidence, joints=joints)).encode()


def nested(depth=40):
    """A list that holds itself twice, as often as that: few bytes, endless numbers."""
    found = [1.0]
    for _ in range(depth):
        found = [found, found]
    return found


def npy(content):
    boxed = np.empty((), dtype=object)
    boxed[()] = content
    stream = io.BytesIO()
    np.save(stream, boxed, allow_pickle=True)
    return stream.getvalue()


def jsonl(**values):
    pose = {"position": [0, 0, 0], "quaternion_wxyz": [1, 0, 0, 0]}
    grasp = {"palm": pose, "joints": [0.0] * context().hand.n_joints}
    return json.dumps({"grasp": grasp, **values}).encode()


class Command:
    def __reduce__(self):
        return os.system, ("touch hacked",)


def header_without_data(shape, kind):
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": kind, "fortran_order": False, "shape": shape})
    return stream.getvalue()


def unfolding_parquet():
    """A row of numbers that are all the same: a few kB hold them all."""
    row = {name: None for name in schema().names}
    table = pa.Table.from_pylist([row], schema=schema())
    joints = pa.array([np.zeros(30_000_000)], type=pa.list_(pa.float64()))
    stage = pa.StructArray.from_arrays(
        [table["grasp"].combine_chunks().field("palm"), joints], ["palm", "joints"]
    )
    stream = io.BytesIO()
    pq.write_table(table.set_column(table.schema.get_field_index("grasp"), "grasp", stage), stream)
    return stream.getvalue()


FILES = {
    "flow.yaml": lambda: isaac(before="[" * 1_000_000 + "\n"),
    "block.yaml": lambda: isaac(before="x: " + "- " * 300_000 + "\n"),
    "keys.yaml": lambda: isaac(before="? " * 300_000 + "\n"),
    "bomb_number.yaml": lambda: isaac(confidence="*b11", before=BOMB),
    "bomb_version.yaml": lambda: isaac(version="*b11", before=BOMB),
    "bomb_joint.yaml": lambda: isaac(joints="{x: *b11}", before=BOMB),
    "object.yaml": lambda: isaac(joints="!!python/object/apply:os.system ['touch hacked']"),
    "bomb.npy": lambda: npy({"grasp_qpos": nested()}),
    "bomb_pose.npy": lambda: npy({"grasp_qpos": [0.0] * 20, "obj_pose": nested(), "obj_path": nested()}),
    "bomb_path.npy": lambda: npy({"grasp_qpos": [0.0] * 7, "obj_path": nested()}),
    "bomb_scale.npy": lambda: npy({"grasp_qpos": [0.0] * 7, "obj_scale": nested()}),
    "bomb_angle.npy": lambda: npy([{"qpos": {"WRJTx": nested()}}]),
    "rows.npy": lambda: npy({"grasp_qpos": np.zeros((3, 9)), "pregrasp_qpos": np.zeros((2, 9))}),
    "ragged.npy": lambda: npy({"grasp_qpos": [[1.0], [1.0, 2.0]]}),
    "code.npy": lambda: npy({"grasp_qpos": Command()}),
    "nothing.npy": lambda: npy(None),
    "number.npy": lambda: npy(3.0),
    "huge.npy": lambda: header_without_data((10**6, 10**6), "<f8"),
    "long_text.npy": lambda: header_without_data((3,), "<U500000000"),
    "cut.npy": lambda: npy({"grasp_qpos": [0.0] * 9})[:-9],
    "pickle.npy": lambda: pickle.dumps({"grasp_qpos": [0.0]}),
    "approach.jsonl": lambda: jsonl(approach=5),
    "contacts.jsonl": lambda: jsonl(contacts=3),
    "contact_text.jsonl": lambda: jsonl(contacts="abc"),
    "hand.jsonl": lambda: jsonl(hand=[1]),
    "scale.jsonl": lambda: jsonl(object_scale=0),
    "scale_far.jsonl": lambda: jsonl(object_scale=1e300),
    "names.jsonl": lambda: jsonl(joint_names=[[1]]),
    "digits.jsonl": lambda: jsonl(confidence=10**400),
    "deep.jsonl": lambda: b"[" * 1_000_000,
    "text.jsonl": lambda: b"\xff\xfe",
    "same.parquet": unfolding_parquet,
    "cut.parquet": lambda: unfolding_parquet()[:-5],
    "none.parquet": lambda: b"PAR1PAR1",
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_what_cannot_be_used_is_told_in_one_sentence(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / name
    path.write_bytes(FILES[name]())
    assert path.stat().st_size < 4_000_000
    formats = [each for each in FORMATS if path.suffix in FORMATS[each].suffixes]
    for chosen in (None, *formats):
        with pytest.raises(GraspFileError) as caught:
            read_grasps(path, context(), chosen)
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 1000
    assert not (tmp_path / "hacked").exists()
    Budget.check_memory()


@pytest.mark.parametrize("suffix", ["jsonl", "npy", "yaml", "parquet"])
def test_no_pipe_is_waited_for_and_no_endless_file_is_read(suffix, tmp_path):
    os.mkfifo(tmp_path / f"pipe.{suffix}")
    with pytest.raises(GraspFileError, match="no file"):
        read_grasps(tmp_path / f"pipe.{suffix}", context())
    with (tmp_path / f"hole.{suffix}").open("wb") as stream:
        stream.truncate(1 << 40)
    with pytest.raises(GraspFileError, match="too large"):
        read_grasps(tmp_path / f"hole.{suffix}", context())
