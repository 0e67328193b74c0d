"""Grasp records as plain values: the schema of our own files, JSON Lines and Parquet alike."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import shown
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FormatContext
from graspbench.evaluation.formats.reading import listed, number, scale_of, text, vector
from graspbench.evaluation.grasp_record import ContactSet, GraspRecord, HandPose
from graspbench.evaluation.transforms import inverse, position_and_quaternion

SCHEMA = 1
OBJECT_FRAMES = ("centre_of_mass", "mesh")
STAGES = ("pregrasp", "grasp", "squeeze")


def to_plain(record: GraspRecord) -> dict[str, Any]:
    """Return a record as plain values; see docs/how-to/evaluate.md for the schema."""
    pose = record.transform_object_to_world
    return {
        "schema": SCHEMA,
        "hand": record.hand,
        "joint_names": list(record.joint_names),
        "object": record.object_name,
        "object_scale": record.object_scale,
        "object_frame": "centre_of_mass",
        "object_pose": None if pose is None else _plain_transform(pose),
        "approach": [_plain_pose(stage) for stage in record.approach],
        **{name: None if (stage := getattr(record, name)) is None else _plain_pose(stage) for name in STAGES},
        "contacts": None
        if record.contacts is None
        else [
            {"point": point.tolist(), "normal": normal.tolist()}
            for point, normal in zip(record.contacts.points, record.contacts.normals, strict=True)
        ],
        "confidence": record.confidence,
        "source": record.source,
    }


def from_plain(plain: Any, context: FormatContext, where: str) -> GraspRecord:
    """Return the record of plain values, joints in the hand's order, poses in the object's frame.

    Args:
        plain: As `to_plain` gives it; what may be None may be missing.
        context: Hand and object.
        where: Which file and grasp, for sentences.

    Raises:
        GraspFileError: Something is missing or of the wrong kind.
    """
    if not isinstance(plain, Mapping):
        raise GraspFileError(
            f"{where} is {shown(plain)}", remedy="give a mapping; docs/how-to/evaluate.md says of what"
        )
    if plain.get("schema", SCHEMA) != SCHEMA:
        raise GraspFileError(
            f"{where} is of schema {shown(plain['schema'])}", remedy=f"this version reads schema {SCHEMA}"
        )
    scale = scale_of(plain.get("object_scale"), f"{where}: object_scale", context.object_scale)
    to_object = _transform_to_object(plain, scale, context, where)
    hand = context.hand
    named = plain.get("joint_names") or hand.joint_names
    order = _order(named, hand.joint_names, hand.name, where)

    def pose(stage: Any, name: str) -> HandPose:
        if not isinstance(stage, Mapping):
            raise GraspFileError(f"{where}: {name} is {shown(stage)}", remedy="give a mapping")
        row = vector(stage.get("joints"), len(named), f"{where}: the joints of {name}")
        joints = hand.rest.copy()
        joints[order] = context.reading.row(row)
        return HandPose(to_object @ _transform(stage.get("palm"), context, f"{where}: {name}"), joints)

    stages = {
        name: None if plain.get(name) is None else pose(plain[name], name)
        for name in ("pregrasp", "grasp", "squeeze")
    }
    contacts = _contacts(plain.get("contacts"), context, to_object, where)
    if stages["grasp"] is None and contacts is None:
        raise GraspFileError(f"{where} has neither a grasp nor contacts", remedy="give one of them")
    given = plain.get("object_pose")
    confidence = plain.get("confidence")
    return GraspRecord(
        hand=text(plain.get("hand"), f"{where}: hand", hand.name),
        joint_names=hand.joint_names,
        object_name=text(plain.get("object"), f"{where}: object", context.object_model.name),
        object_scale=scale,
        **stages,
        approach=tuple(
            pose(stage, f"approach[{i}]")
            for i, stage in enumerate(listed(plain.get("approach") or (), f"{where}: approach"))
        ),
        contacts=contacts,
        transform_object_to_world=None
        if given is None
        else _transform(given, context, f"{where}: object_pose") @ inverse(to_object),
        confidence=None if confidence is None else number(confidence, f"{where}: confidence"),
        source=text(plain.get("source"), f"{where}: source", ""),
    )


def _transform_to_object(
    plain: Mapping[str, Any], scale: float, context: FormatContext, where: str
) -> FloatArray:
    frame = plain.get("object_frame") or OBJECT_FRAMES[0]
    if frame not in OBJECT_FRAMES:
        raise GraspFileError(
            f"{where}: object_frame is {shown(frame)}", remedy=f"choose one of {', '.join(OBJECT_FRAMES)}"
        )
    return np.eye(4) if frame == OBJECT_FRAMES[0] else context.transform_file_to_object(scale)


def _order(named: Any, known: Sequence[str], hand: str, where: str) -> list[int]:
    names = list(named) if isinstance(named, Sequence) and not isinstance(named, str) else [named]
    if unknown := [name for name in names if name not in known]:
        raise GraspFileError(
            f"{where}: hand '{hand}' has no joint {shown(unknown[0])}", remedy=f"it has {', '.join(known)}"
        )
    if len(set(names)) < len(known):
        missing = next((name for name in known if name not in names), names[0])
        raise GraspFileError(
            f"{where}: joint_names lacks '{missing}' or has a name twice", remedy="name each once"
        )
    return [list(known).index(name) for name in names]


def _transform(plain: Any, context: FormatContext, where: str) -> FloatArray:
    if not isinstance(plain, Mapping):
        raise GraspFileError(
            f"{where} has no pose but {shown(plain)}", remedy="give position and quaternion_wxyz"
        )
    return context.reading.transform(plain.get("position"), plain.get("quaternion_wxyz"), where)


def _contacts(plain: Any, context: FormatContext, to_object: FloatArray, where: str) -> ContactSet | None:
    if plain is None:
        return None
    points, normals = [], []
    for i, contact in enumerate(listed(plain, f"{where}: contacts")):
        if not isinstance(contact, Mapping):
            raise GraspFileError(f"{where}: contact {i} is {shown(contact)}", remedy="give point and normal")
        at = context.reading.metres_per_unit * vector(
            contact.get("point"), 3, f"{where}: point of contact {i}"
        )
        normal = vector(contact.get("normal"), 3, f"{where}: normal of contact {i}")
        length = float(np.linalg.norm(normal))
        if length < 1e-6:
            raise GraspFileError(f"{where}: the normal of contact {i} is zero", remedy="give unit normals")
        points.append(to_object[:3, :3] @ at + to_object[:3, 3])
        normals.append(to_object[:3, :3] @ normal / length)
    return ContactSet(np.array(points).reshape(-1, 3), np.array(normals).reshape(-1, 3))


def _plain_transform(transform: FloatArray) -> dict[str, list[float]]:
    position, quaternion = position_and_quaternion(transform)
    return {"position": position.tolist(), "quaternion_wxyz": quaternion.tolist()}


def _plain_pose(pose: HandPose) -> dict[str, Any]:
    return {"palm": _plain_transform(pose.transform_palm_to_object), "joints": pose.joints.tolist()}
