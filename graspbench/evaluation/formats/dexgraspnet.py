"""DexGraspNet files: a list of ``{scale, qpos}``, the wrist as a translation and angles, joints by name.

Wang et al. 2023, "DexGraspNet". The hand's frame is turned by Rz Ry Rx (angles about fixed axes x, y, z) and
moved in the frame of the object's mesh, which is scaled by ``scale``.
"""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.errors import shown
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FORMATS, FormatContext
from graspbench.evaluation.formats.hand_layout import HandLayout, hand_layout
from graspbench.evaluation.formats.reading import Reading, listed, number, scale_of
from graspbench.evaluation.formats.unpickling import grasps_of, load_npy
from graspbench.evaluation.grasp_record import GraspRecord, HandPose
from graspbench.evaluation.transforms import inverse
from graspbench.results.store import write_atomically

_TRANSLATION = ("WRJTx", "WRJTy", "WRJTz")
_ANGLES = ("WRJRx", "WRJRy", "WRJRz")


class DexGraspNet:
    """A list of dicts, all of one object."""

    description = "DexGraspNet: a list of {scale, qpos} with named joints and WRJTx.., WRJRx.."
    suffixes: tuple[str, ...] = (".npy",)

    def recognises(self, path: Path) -> bool:
        """Tell by the keys."""
        content = load_npy(path)
        first = content[0] if isinstance(content, np.ndarray | list) and len(content) else None
        return isinstance(first, Mapping) and isinstance(first.get("qpos"), Mapping)

    def read(self, path: Path, context: FormatContext) -> tuple[GraspRecord, ...]:
        """Return the grasps of a file; see `GraspFormat.read`."""
        layout = hand_layout(context.hand, "dexgraspnet")
        return tuple(
            _record(grasp, layout, context, f"{path}, grasp {i}") for i, grasp in enumerate(_grasps(path))
        )

    def write(self, path: Path, records: Sequence[GraspRecord], context: FormatContext) -> None:
        """Write grasps; see `GraspFormat.write`."""
        layout = hand_layout(context.hand, "dexgraspnet")
        content: Any = np.empty(len(records), dtype=object)
        content[:] = [_plain(record, layout, context) for record in records]
        buffer = io.BytesIO()
        np.save(buffer, content, allow_pickle=True)
        write_atomically(path, buffer.getvalue())


def _grasps(path: Path) -> Sequence[object]:
    content = load_npy(path)
    return listed(grasps_of(content), str(path))


def _record(grasp: Any, layout: HandLayout, context: FormatContext, where: str) -> GraspRecord:
    if not isinstance(grasp, Mapping) or not isinstance(grasp.get("qpos"), Mapping):
        raise GraspFileError(
            f"{where} is {shown(grasp)}", remedy="give {scale: S, qpos: {JOINT: ANGLE, ...}}"
        )
    scale = scale_of(grasp.get("scale"), f"{where}: scale", context.object_scale)
    to_object = context.transform_file_to_object(scale)
    return GraspRecord(
        hand=context.hand.name,
        joint_names=context.hand.joint_names,
        object_name=context.object_model.name,
        object_scale=scale,
        grasp=_pose(grasp["qpos"], to_object, layout, context.reading, f"{where}: qpos"),
        source="dexgraspnet",
    )


def _pose(
    given: Mapping[str, Any], to_object: FloatArray, layout: HandLayout, reading: Reading, where: str
) -> HandPose:
    values = {str(name): number(value, f"{where}.{name}") for name, value in given.items()}
    if missing := [name for name in (*_TRANSLATION, *_ANGLES) if name not in values]:
        raise GraspFileError(f"{where} has no '{missing[0]}'", remedy="give the wrist as WRJTx.. and WRJRx..")
    pose = np.eye(4)
    angles = reading.radians_per_unit * np.array([values.pop(name) for name in _ANGLES])
    pose[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
    pose[:3, 3] = reading.metres_per_unit * np.array([values.pop(name) for name in _TRANSLATION])
    return layout.pose_by_name(to_object @ pose, values, where, reading)


def _plain(record: GraspRecord, layout: HandLayout, context: FormatContext) -> dict[str, Any]:
    if record.grasp is None:
        raise GraspFileError(
            "a grasp of contacts alone cannot be written as dexgraspnet", remedy="choose jsonl or parquet"
        )
    transform, joints = layout.stated(record.grasp)
    pose = inverse(context.transform_file_to_object(record.object_scale)) @ transform
    angles = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz", suppress_warnings=True)
    qpos = {
        **dict(zip(_TRANSLATION, pose[:3, 3].tolist(), strict=True)),
        **dict(zip(_ANGLES, np.asarray(angles).tolist(), strict=True)),
        **dict(zip(layout.file_joints, joints.tolist(), strict=True)),
    }
    return {"scale": float(record.object_scale), "qpos": qpos}


FORMATS.register("dexgraspnet")(DexGraspNet())
