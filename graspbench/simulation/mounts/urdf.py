"""The URDF of a hand, and links and joints that put it on a mount."""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable

from graspbench.arrays import FloatArray
from graspbench.hand.model import HandModel
from graspbench.simulation.inertia import mend_inertias

# Light against any object, heavy against the solver's round-off.
_MASS_KG, _INERTIA_KGM2 = 0.2, 1e-3


def hand_robot(hand: HandModel) -> tuple[ElementTree.Element, str]:
    """Return the hand's URDF for PyBullet, with possible inertias, and its root link."""
    robot = ElementTree.parse(hand.urdf_path).getroot()
    mend_inertias(robot)
    children = {
        _attribute(joint, "child") for joint in robot.iter("joint") if joint.find("child") is not None
    }
    root = next(link.get("name", "") for link in robot.findall("link") if link.get("name") not in children)
    return robot, root


def light_link(name: str) -> ElementTree.Element:
    """Return a link without a shape that weighs little."""
    link = ElementTree.Element("link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value=str(_MASS_KG))
    moments = {"ixx": _INERTIA_KGM2, "iyy": _INERTIA_KGM2, "izz": _INERTIA_KGM2}
    products = {"ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
    ElementTree.SubElement(inertial, "inertia", {k: str(v) for k, v in (moments | products).items()})
    return link


def strong_joint(name: str, kind: str, parent: str, child: str, axis: str) -> ElementTree.Element:
    """Return a sliding or turning joint with limits that are never met.

    Args:
        name: Name of the joint.
        kind: "prismatic" or "revolute".
        parent: Link before it.
        child: Link behind it.
        axis: Its axis, three numbers.
    """
    joint = _joint(name, kind, parent, child)
    ElementTree.SubElement(joint, "axis", xyz=axis)
    ElementTree.SubElement(joint, "limit", lower="-10", upper="10", effort="10000", velocity="100")
    return joint


def fixed_joint(
    name: str, parent: str, child: str, xyz_m: Iterable[float], rpy: Iterable[float]
) -> ElementTree.Element:
    """Return a joint that holds a link in its parent: position, and angles about fixed axes, rad."""
    joint = _joint(name, "fixed", parent, child)
    ElementTree.SubElement(
        joint,
        "origin",
        xyz=" ".join(f"{value:.15g}" for value in xyz_m),
        rpy=" ".join(f"{angle:.15g}" for angle in rpy),
    )
    return joint


def _joint(name: str, kind: str, parent: str, child: str) -> ElementTree.Element:
    joint = ElementTree.Element("joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    return joint


def roll_pitch_yaw(rotation: FloatArray) -> tuple[float, float, float]:
    """Return angles about fixed axes x, y, z as URDF has them, also where two of them do the same."""
    r = rotation
    cosine = math.hypot(r[0, 0], r[1, 0])
    pitch = math.atan2(-r[2, 0], cosine)
    if cosine > 1e-9:
        return math.atan2(r[2, 1], r[2, 2]), pitch, math.atan2(r[1, 0], r[0, 0])
    return 0.0, pitch, math.atan2(-r[0, 1], r[1, 1])


def _attribute(joint: ElementTree.Element, tag: str) -> str:
    part = joint.find(tag)
    return "" if part is None else part.get("link", "")
