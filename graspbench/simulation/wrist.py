"""A hand's URDF on a wrist of six joints, so that physics can carry it about."""

import copy
import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.model import HandModel

WRIST_JOINTS = ("wrist_x", "wrist_y", "wrist_z", "wrist_rx", "wrist_ry", "wrist_rz")
_AXES = ("1 0 0", "0 1 0", "0 0 1") * 2
# Light against any object, heavy against the solver's round-off.
_MASS_KG, _INERTIA_KGM2 = 0.2, 1e-3


def mounted_urdf(hand: HandModel, rotation_root_to_wrist: FloatArray) -> str:
    """Return the hand's URDF with three sliding and three turning joints before its root link.

    Mesh files become absolute paths, so the text may be stored anywhere.

    Args:
        hand: The hand.
        rotation_root_to_wrist: How the hand's root link is fixed to the last wrist link, shape (3, 3).

    Raises:
        HandError: A mesh file of the URDF cannot be found.
    """
    robot = ElementTree.parse(hand.urdf_path).getroot()
    for mesh in robot.iter("mesh"):
        mesh.set("filename", str(_mesh_path(hand, mesh.get("filename", ""))))
    children = {
        _attribute(joint, "child") for joint in robot.iter("joint") if joint.find("child") is not None
    }
    root = next(link.get("name", "") for link in robot.findall("link") if link.get("name") not in children)
    mount = ElementTree.Element("robot", robot.attrib)
    mount.append(_link("wrist_base"))
    parent = "wrist_base"
    for name, axis in zip(WRIST_JOINTS, _AXES, strict=True):
        mount.append(_link(f"{name}_link"))
        kind = "revolute" if "_r" in name else "prismatic"
        joint = _joint(name, kind, parent, f"{name}_link", axis)
        mount.append(joint)
        parent = f"{name}_link"
    fixed = _joint("wrist_mount", "fixed", parent, root, None)
    rpy = Rotation.from_matrix(rotation_root_to_wrist).as_euler("xyz")
    ElementTree.SubElement(fixed, "origin", xyz="0 0 0", rpy=" ".join(f"{angle:.15g}" for angle in rpy))
    mount.append(fixed)
    mount.extend(copy.deepcopy(part) for part in robot)
    return ElementTree.tostring(mount, encoding="unicode")


def wrist_coordinates(pose_wrist_in_base: FloatArray) -> FloatArray:
    """Return the six wrist joints of a pose of the last wrist link in the base frame, shape (6,)."""
    r = pose_wrist_in_base
    second = math.atan2(r[0, 2], math.hypot(r[0, 0], r[0, 1]))
    if math.hypot(r[0, 0], r[0, 1]) > 1e-9:
        first, third = math.atan2(-r[1, 2], r[2, 2]), math.atan2(-r[0, 1], r[0, 0])
    else:  # gimbal lock: one of the two does for both
        first, third = 0.0, math.atan2(r[1, 0], r[1, 1])
    return np.array([r[0, 3], r[1, 3], r[2, 3], first, second, third])


def wrist_pose(coordinates: FloatArray) -> FloatArray:
    """Return the pose of the last wrist link in the base frame, shape (4, 4), for the six joints."""
    (a, b, c), (sa, sb, sc) = np.cos(coordinates[3:]), np.sin(coordinates[3:])
    return np.array(
        [
            [b * c, -b * sc, sb, coordinates[0]],
            [a * sc + sa * sb * c, a * c - sa * sb * sc, -sa * b, coordinates[1]],
            [sa * sc - a * sb * c, sa * c + a * sb * sc, a * b, coordinates[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _mesh_path(hand: HandModel, name: str) -> Path:
    if name.startswith("package://"):
        candidates = [folder / name.removeprefix("package://") for folder in hand.package_dirs]
    else:
        plain = Path(name.removeprefix("file://"))
        candidates = [plain if plain.is_absolute() else hand.urdf_path.parent / plain]
    for path in candidates:
        if path.is_file():
            return path
    raise HandError(
        f"mesh '{name}' of hand '{hand.name}' is not found", remedy="check hand.package_dirs", mesh=name
    )


def _link(name: str) -> ElementTree.Element:
    link = ElementTree.Element("link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value=str(_MASS_KG))
    moments = {"ixx": _INERTIA_KGM2, "iyy": _INERTIA_KGM2, "izz": _INERTIA_KGM2}
    products = {"ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
    ElementTree.SubElement(inertial, "inertia", {k: str(v) for k, v in (moments | products).items()})
    return link


def _joint(name: str, kind: str, parent: str, child: str, axis: str | None) -> ElementTree.Element:
    joint = ElementTree.Element("joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    if axis is not None:
        ElementTree.SubElement(joint, "axis", xyz=axis)
        ElementTree.SubElement(joint, "limit", lower="-10", upper="10", effort="10000", velocity="100")
    return joint


def _attribute(joint: ElementTree.Element, tag: str) -> str:
    part = joint.find(tag)
    return "" if part is None else part.get("link", "")
