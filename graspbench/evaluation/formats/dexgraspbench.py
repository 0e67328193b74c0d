"""DexGraspBench files: a dict a grasp, saved by NumPy, with poses in the world and quaternions w first.

Chen et al. 2025, "BODex", and its benchmark. ``pregrasp_qpos``, ``grasp_qpos`` and ``squeeze_qpos`` hold
7 numbers of the hand's pose and then its joints; several grasps of an object may stand one a row.
"""

import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import shown
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FORMATS, FormatContext
from graspbench.evaluation.formats.hand_layout import HandLayout, hand_layout
from graspbench.evaluation.formats.reading import array, listed, scale_of, text, vector
from graspbench.evaluation.formats.unpickling import grasps_of, load_npy
from graspbench.evaluation.grasp_record import GraspRecord, HandPose
from graspbench.evaluation.transforms import inverse, position_and_quaternion
from graspbench.results.store import write_atomically

_STAGES = ("pregrasp", "grasp", "squeeze")


class DexGraspBench:
    """One dict a file, or a list of them; several grasps are written as a list."""

    description = "DexGraspBench and BODex: a dict a grasp (obj_pose, grasp_qpos, ...)"
    suffixes: tuple[str, ...] = (".npy",)

    def recognises(self, path: Path) -> bool:
        """Tell by the keys."""
        first = _first(load_npy(path))
        return isinstance(first, Mapping) and "grasp_qpos" in first

    def read(self, path: Path, context: FormatContext) -> tuple[GraspRecord, ...]:
        """Return the grasps of a file; see `GraspFormat.read`."""
        content = load_npy(path)
        if isinstance(content, Mapping):
            content = [content]
        content = listed(grasps_of(content), str(path))
        layout = hand_layout(context.hand, "dexgraspbench")
        records: list[GraspRecord] = []
        for i, grasp in enumerate(content):
            where = str(path) if len(content) == 1 else f"{path}, grasp {i}"
            if not isinstance(grasp, Mapping) or "grasp_qpos" not in grasp:
                raise GraspFileError(f"{where} has no 'grasp_qpos'", remedy="give a dict a grasp")
            records += [_record(row, layout, context, where) for row in _rows(grasp, where)]
        return tuple(records)

    def write(self, path: Path, records: Sequence[GraspRecord], context: FormatContext) -> None:
        """Write grasps; see `GraspFormat.write`."""
        layout = hand_layout(context.hand, "dexgraspbench")
        plain = [_plain(record, layout, context) for record in records]
        content: Any = np.empty((), dtype=object)
        if len(plain) == 1:
            content[()] = plain[0]
        else:
            content = np.empty(len(plain), dtype=object)
            content[:] = plain
        buffer = io.BytesIO()
        np.save(buffer, content, allow_pickle=True)
        write_atomically(path, buffer.getvalue())


def _first(content: Any) -> Any:
    return content[0] if isinstance(content, np.ndarray | list) and len(content) else content


def _rows(grasp: Mapping[str, Any], where: str) -> Iterator[Mapping[str, Any]]:
    """Yield one dict a grasp where the arrays hold one a row."""
    joints = array(grasp["grasp_qpos"], f"{where}: grasp_qpos")
    if joints.ndim != 2:
        yield grasp
        return
    keys = [f"{stage}_{part}" for stage in _STAGES for part in ("qpos", "pose") if f"{stage}_{part}" in grasp]
    rows = {key: array(grasp[key], f"{where}: {key}") for key in keys}
    if short := [key for key, found in rows.items() if found.ndim != 2 or len(found) != len(joints)]:
        raise GraspFileError(f"{where}: {short[0]} has not as many rows as grasp_qpos", remedy="correct it")
    for i in range(len(joints)):
        yield {**grasp, **{key: found[i] for key, found in rows.items()}}


def _record(grasp: Mapping[str, Any], layout: HandLayout, context: FormatContext, where: str) -> GraspRecord:
    pose = vector(grasp.get("obj_pose", (0, 0, 0, 1, 0, 0, 0)), 7, f"{where}: obj_pose")
    file_to_world = context.reading.transform(pose[:3], pose[3:], f"{where}: obj_pose")
    scale = _scale(grasp.get("obj_scale"), context.object_scale, f"{where}: obj_scale")
    mesh_to_object = context.transform_file_to_object(scale)
    to_object = mesh_to_object @ inverse(file_to_world)

    def stage(name: str) -> HandPose | None:
        row = grasp.get(f"{name}_qpos")
        if row is None:
            return None
        count, label = len(layout.file_joints), f"{where}: {name}_qpos"
        if f"{name}_pose" in grasp:
            pose = array(grasp[f"{name}_pose"], f"{where}: {name}_pose")
            row = np.concatenate((pose.ravel(), array(row, label).ravel()))
        numbers = vector(row, None, label)
        if len(numbers) != 7 + count:
            raise GraspFileError(
                f"{label} has {len(numbers)} numbers, and hand '{context.hand.name}' takes 7 + {count}",
                remedy="choose the hand that the file is of",
            )
        hand_to_world = context.reading.transform(numbers[:3], numbers[3:7], label)
        return layout.pose(to_object @ hand_to_world, context.reading.row(numbers[7:]))

    approach = grasp.get("approach_qpos")
    return GraspRecord(
        hand=context.hand.name,
        joint_names=context.hand.joint_names,
        object_name=text(grasp.get("obj_path"), f"{where}: obj_path", context.object_model.name),
        object_scale=scale,
        grasp=stage("grasp"),
        pregrasp=stage("pregrasp"),
        squeeze=stage("squeeze"),
        approach=() if approach is None else _approach(approach, layout, context, to_object, where),
        transform_object_to_world=file_to_world @ inverse(mesh_to_object),
        source="dexgraspbench",
    )


def _approach(
    rows: Any, layout: HandLayout, context: FormatContext, to_object: FloatArray, where: str
) -> tuple[HandPose, ...]:
    count, poses = 7 + len(layout.file_joints), []
    for i, row in enumerate(np.atleast_2d(array(rows, f"{where}: approach_qpos"))):
        numbers = vector(row, count, f"{where}: approach_qpos[{i}]")
        at = context.reading.transform(numbers[:3], numbers[3:7], f"{where}: approach_qpos[{i}]")
        poses.append(layout.pose(to_object @ at, context.reading.row(numbers[7:])))
    return tuple(poses)


def _scale(value: Any, default: float, where: str) -> float:
    """Return a scale, which may be given for each axis."""
    numbers = array(default if value is None else value, where).ravel()
    if len(numbers) == 0 or np.any(numbers != numbers[0]):
        raise GraspFileError(f"{where} is {shown(value)}", remedy="give one number")
    return scale_of(numbers[0], where)


def _plain(record: GraspRecord, layout: HandLayout, context: FormatContext) -> dict[str, Any]:
    if record.grasp is None:
        raise GraspFileError(
            "a grasp of contacts alone cannot be written as dexgraspbench", remedy="choose jsonl or parquet"
        )
    object_to_world = record.transform_object_to_world
    object_to_world = np.eye(4) if object_to_world is None else object_to_world
    mesh_to_object = context.transform_file_to_object(record.object_scale)

    def row(pose: HandPose) -> FloatArray:
        transform, joints = layout.stated(pose)
        return np.concatenate((*position_and_quaternion(object_to_world @ transform), joints))

    plain: dict[str, Any] = {
        "obj_pose": np.concatenate(position_and_quaternion(object_to_world @ mesh_to_object)),
        "obj_scale": float(record.object_scale),
        "obj_path": record.object_name,
        "pregrasp_qpos": row(record.pregrasp or record.grasp),
        "grasp_qpos": row(record.grasp),
        "squeeze_qpos": row(record.squeeze or record.grasp),
    }
    if record.approach:
        plain["approach_qpos"] = np.stack([row(pose) for pose in record.approach])
    return plain


FORMATS.register("dexgraspbench")(DexGraspBench())
