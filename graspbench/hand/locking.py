"""Joints that do not move: locked by the description, or between the root link and the palm."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.parameters import HandParameters


def lock_joints(robot: ElementTree.Element, parameters: HandParameters) -> None:
    """Make joints fixed, in place: those of ``hand.locked_deg``, and any that moves the palm.

    Args:
        robot: The URDF.
        parameters: The hand's description. A joint between root link and palm (wrist, forearm) is held at the
            angle in ``locked_deg``, else at 0 or the limit nearest to it.

    Raises:
        HandError: A joint to lock is unknown, or one that moves follows another (mimic).
    """
    hand = parameters.name
    joints = {joint.get("name", ""): joint for joint in robot.findall("joint")}
    unknown = [name for name in parameters.locked_deg if name not in joints]
    if unknown:
        raise HandError(
            f"hand '{hand}' has no joint '{unknown[0]}' to lock",
            remedy=f"name in hand.locked_deg some of {', '.join(joints)}",
            joint=unknown[0],
        )
    above_palm = _joints_above(joints, parameters.palm.link)
    for name, joint in joints.items():
        if name in parameters.locked_deg or (name in above_palm and joint.get("type") != "fixed"):
            _fix(joint, parameters.locked_deg.get(name))
    for name, joint in joints.items():
        mimic = joint.find("mimic")
        if mimic is not None and joint.get("type") != "fixed":
            raise HandError(
                f"joint '{name}' of hand '{hand}' follows joint '{mimic.get('joint')}' (mimic), which is not "
                "supported",
                remedy=f"lock it with hand.locked_deg={{{name}: 0}}, or take its mimic element out",
                joint=name,
            )


def _joints_above(joints: dict[str, ElementTree.Element], link: str) -> set[str]:
    """Return the joints between the root link and a link."""
    by_child = {_link(joint, "child"): name for name, joint in joints.items()}
    found: set[str] = set()
    while link in by_child and by_child[link] not in found:
        name = by_child[link]
        found.add(name)
        link = _link(joints[name], "parent")
    return found


def _link(joint: ElementTree.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _fix(joint: ElementTree.Element, angle_deg: float | None) -> None:
    """Turn a joint into a fixed one at an angle; a sliding one stays where 0 is."""
    kind = joint.get("type")
    if kind in ("revolute", "continuous"):
        axis = _numbers(joint.find("axis"), "xyz", (1.0, 0.0, 0.0))
        angle = _nearest_to_zero(joint) if angle_deg is None else float(np.radians(angle_deg))
        origin = joint.find("origin")
        if origin is None:
            origin = ElementTree.SubElement(joint, "origin", xyz="0 0 0")
        turned = pinocchio.rpy.rpyToMatrix(_numbers(origin, "rpy", (0.0, 0.0, 0.0))) @ pinocchio.exp3(
            angle * axis / np.linalg.norm(axis)
        )
        origin.set("rpy", " ".join(f"{value:.15g}" for value in pinocchio.rpy.matrixToRpy(turned)))
    joint.set("type", "fixed")
    for tag in ("axis", "limit", "mimic", "dynamics"):
        for element in joint.findall(tag):
            joint.remove(element)


def _nearest_to_zero(joint: ElementTree.Element) -> float:
    limit = joint.find("limit")
    if limit is None or joint.get("type") == "continuous":
        return 0.0
    return float(np.clip(0.0, float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0))))


def _numbers(
    element: ElementTree.Element | None, name: str, default: tuple[float, float, float]
) -> FloatArray:
    text = None if element is None else element.get(name)
    return np.array(default if text is None else [float(part) for part in text.split()])
