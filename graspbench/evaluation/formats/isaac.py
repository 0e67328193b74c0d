"""Isaac grasp files: YAML of version 1.0, joints by name, poses of the gripper in the object's frame.

NVIDIA Isaac ROS, "Isaac Grasp File" (isaac_grasp, format_version 1.0).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from graspbench.errors import shown
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FORMATS, FormatContext
from graspbench.evaluation.formats.hand_layout import HandLayout, hand_layout
from graspbench.evaluation.formats.reading import number, vector
from graspbench.evaluation.grasp_record import GraspRecord, HandPose
from graspbench.evaluation.transforms import inverse, position_and_quaternion
from graspbench.results.store import write_atomically

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_DUMPER: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_MAX_BYTES = 64 << 20
_MAX_DEPTH = 20
_KIND = "isaac_grasp"


class IsaacGrasp:
    """Grasps by name; of each the gripper's pose, its joints closed and open."""

    description = "Isaac grasp YAML 1.0 (isaac_grasp)"
    suffixes: tuple[str, ...] = (".yaml", ".yml")

    def recognises(self, path: Path) -> bool:
        """Tell by the file's first lines."""
        with path.open("rb") as stream:
            return _KIND.encode() in stream.read(4096)

    def read(self, path: Path, context: FormatContext) -> tuple[GraspRecord, ...]:
        """Return the grasps of a file; see `GraspFormat.read`."""
        content = _parsed(path)
        grasps = content.get("grasps")
        if content.get("format") != _KIND or not isinstance(grasps, Mapping):
            raise GraspFileError(f"{path} is no {_KIND} file", remedy=f"give 'format: {_KIND}' and 'grasps:'")
        if content.get("format_version") not in (1, "1", "1.0"):
            raise GraspFileError(
                f"{path} is of version {shown(content.get('format_version'))}",
                remedy="this reads version 1.0",
            )
        layout = hand_layout(context.hand, "isaac")
        return tuple(
            _record(grasp, layout, context, f"{path}, grasp '{name}'") for name, grasp in grasps.items()
        )

    def write(self, path: Path, records: Sequence[GraspRecord], context: FormatContext) -> None:
        """Write grasps; see `GraspFormat.write`."""
        layout = hand_layout(context.hand, "isaac")
        content = {
            "format": _KIND,
            "format_version": 1.0,
            "object_frame": context.object_model.name,
            "gripper_frame": context.hand.palm_link,
            "grasps": {f"grasp_{i}": _plain(record, layout, context) for i, record in enumerate(records)},
        }
        write_atomically(path, yaml.dump(content, Dumper=_DUMPER, sort_keys=False, default_flow_style=None))


def _record(grasp: Any, layout: HandLayout, context: FormatContext, where: str) -> GraspRecord:
    if not isinstance(grasp, Mapping):
        raise GraspFileError(f"{where} is {shown(grasp)}", remedy="give a mapping")
    turn = grasp.get("orientation")
    if not isinstance(turn, Mapping):
        raise GraspFileError(f"{where}: orientation is {shown(turn)}", remedy="give {w: W, xyz: [X, Y, Z]}")
    xyz = vector(turn.get("xyz"), 3, f"{where}: orientation.xyz").tolist()
    quaternion = [number(turn.get("w"), f"{where}: orientation.w"), *xyz]
    pose = context.transform_file_to_object(context.object_scale) @ context.reading.transform(
        grasp.get("position"), quaternion, where
    )
    confidence = grasp.get("confidence")
    return GraspRecord(
        hand=context.hand.name,
        joint_names=context.hand.joint_names,
        object_name=context.object_model.name,
        object_scale=context.object_scale,
        grasp=_hand_pose(grasp.get("cspace_position"), pose, layout, context, f"{where}: cspace_position"),
        pregrasp=None
        if grasp.get("pregrasp_cspace_position") is None
        else _hand_pose(
            grasp["pregrasp_cspace_position"], pose, layout, context, f"{where}: pregrasp_cspace_position"
        ),
        confidence=None if confidence is None else number(confidence, f"{where}: confidence"),
        source="isaac",
    )


def _hand_pose(joints: Any, pose: Any, layout: HandLayout, context: FormatContext, where: str) -> HandPose:
    if not isinstance(joints, Mapping):
        raise GraspFileError(f"{where} is {shown(joints)}", remedy="give the joints by name")
    stated = {str(name): number(value, f"{where}.{name}") for name, value in joints.items()}
    return layout.pose_by_name(pose, stated, where, context.reading)


def _plain(record: GraspRecord, layout: HandLayout, context: FormatContext) -> dict[str, Any]:
    if record.grasp is None:
        raise GraspFileError(
            "a grasp of contacts alone cannot be written as isaac", remedy="choose jsonl or parquet"
        )
    to_file = inverse(context.transform_file_to_object(record.object_scale))
    pose, joints = layout.stated(record.grasp)
    position, quaternion = position_and_quaternion(to_file @ pose)
    plain = {
        "confidence": 1.0 if record.confidence is None else record.confidence,
        "position": position.tolist(),
        "orientation": {"w": float(quaternion[0]), "xyz": quaternion[1:].tolist()},
        "cspace_position": dict(zip(layout.file_joints, joints.tolist(), strict=True)),
    }
    if record.pregrasp is not None:
        opened = layout.stated(record.pregrasp)[1]
        plain["pregrasp_cspace_position"] = dict(zip(layout.file_joints, opened.tolist(), strict=True))
    return plain


def _is_deep(text: str) -> bool:
    """Tell YAML that is nested far too deeply: the loader in C dies of it."""
    depth = 0
    for event in yaml.parse(text, Loader=_LOADER):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _MAX_DEPTH:
            return True
    return False


def _parsed(path: Path) -> Mapping[str, Any]:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise GraspFileError(f"{path} is too large", remedy="split it")
        text = path.read_text(encoding="utf-8")
        if _is_deep(text):
            raise GraspFileError(f"{path} is nested too deeply", remedy="correct the file")
        content = yaml.load(text, Loader=_LOADER)
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        said = " ".join(str(error).split())[:120]
        raise GraspFileError(f"{path} is no readable YAML ({said})", remedy="correct the file") from None
    if not isinstance(content, Mapping):
        raise GraspFileError(f"{path} is no mapping", remedy=f"give 'format: {_KIND}' and 'grasps:'")
    return content


FORMATS.register("isaac")(IsaacGrasp())
