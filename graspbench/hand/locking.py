"""Joints that do not move: locked by the description, or between the root link and the palm."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.parameters import HandParameters

_MIN_RATIO = 1e-3


def lock_joints(robot: ElementTree.Element, parameters: HandParameters) -> None:
    """Make joints fixed, in place: those of ``hand.locked_deg``, and any that moves the palm.

    Joints that follow a fixed one are fixed too; limits of one that others follow are narrowed to theirs.

    Args:
        robot: The URDF.
        parameters: The hand's description. A joint between root link and palm (wrist, forearm) is held at the
            angle in ``locked_deg``, else at 0 or the limit nearest to it.

    Raises:
        HandError: A joint to lock is unknown, or one follows (mimic) another that is not there, or itself.
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
    _resolve_followers(joints, hand)
    _lead_by_first(joints)
    above_palm = _joints_above(joints, parameters.palm.link)
    held: dict[str, float] = {}
    for name, joint in joints.items():
        moves = joint.get("type") != "fixed"
        if name in parameters.locked_deg or (name in above_palm and moves):
            held[name] = _fix(joint, parameters.locked_deg.get(name))
    for joint in joints.values():
        mimic = joint.find("mimic")
        if mimic is None or joint.get("type") == "fixed":
            continue
        leader = mimic.get("joint", "")
        if joints[leader].get("type") == "fixed":
            _fix_at(joint, float(mimic.get("multiplier", 1.0)) * held.get(leader, 0.0) + _offset(mimic))
        else:
            _tighten(joints[leader], joint, mimic)
            _refuse_held(joints[leader], joint, parameters.name)


def _resolve_followers(joints: dict[str, ElementTree.Element], hand: str) -> None:
    """Let every joint that follows another name one that follows none."""
    for name, joint in joints.items():
        mimic = joint.find("mimic")
        if mimic is None:
            continue
        if joint.get("type") not in ("revolute", "continuous", "prismatic"):
            joint.remove(mimic)
            continue
        seen, ratio, offset, leader = {name}, 1.0, 0.0, name
        while mimic is not None:
            offset += ratio * _offset(mimic)
            ratio *= float(mimic.get("multiplier", 1.0))
            leader = mimic.get("joint", "")
            if leader not in joints or leader in seen:
                raise HandError(
                    f"joint '{name}' of hand '{hand}' follows (mimic) the joint '{leader}', "
                    + ("and so itself" if leader in seen else "which is not there"),
                    remedy="correct the mimic element, or take it out",
                    joint=name,
                )
            seen.add(leader)
            mimic = joints[leader].find("mimic")
        if not np.isfinite(ratio) or not np.isfinite(offset) or abs(ratio) < _MIN_RATIO:
            raise HandError(
                f"joint '{name}' of hand '{hand}' follows joint '{leader}' with the multiplier {ratio:g} and "
                f"the offset {offset:g}",
                remedy=f"give other numbers, or lock it with hand.locked_deg={{{name}: 0}}",
                joint=name,
            )
        own = joint.find("mimic")
        assert own is not None
        for key, value in (("joint", leader), ("multiplier", f"{ratio:.15g}"), ("offset", f"{offset:.15g}")):
            own.set(key, value)


def _lead_by_first(joints: dict[str, ElementTree.Element]) -> None:
    """Let the first of joints that move together lead the others: Pinocchio reads leaders first."""
    order = {name: place for place, name in enumerate(_reading_order(joints))}
    groups: dict[str, list[str]] = {}
    for name, joint in joints.items():
        mimic = joint.find("mimic")
        if mimic is not None:
            groups.setdefault(mimic.get("joint", ""), []).append(name)
    for leader, followers in groups.items():
        first = min((leader, *followers), key=lambda name: order.get(name, len(order)))
        own = joints[first].find("mimic")
        if own is None or joints[leader].get("type") == "fixed":
            continue
        ratio, offset = float(own.get("multiplier", 1.0)), _offset(own)
        _tighten(joints[leader], joints[first], own)
        _carry_limits(joints[leader], joints[first], ratio, offset)
        joints[first].remove(own)
        # leader = (first - offset) / ratio, and so on for all that follow it.
        ElementTree.SubElement(
            joints[leader],
            "mimic",
            joint=first,
            multiplier=f"{1.0 / ratio:.15g}",
            offset=f"{-offset / ratio:.15g}",
        )
        for name in followers:
            mimic = joints[name].find("mimic")
            if mimic is not None and name != first:
                other = float(mimic.get("multiplier", 1.0))
                shift = _offset(mimic) - other * offset / ratio
                mimic.set("joint", first)
                mimic.set("multiplier", f"{other / ratio:.15g}")
                mimic.set("offset", f"{shift:.15g}")


def _reading_order(joints: dict[str, ElementTree.Element]) -> list[str]:
    """Return the joints as Pinocchio reads them: depth first, by name where links branch."""
    below: dict[str, list[str]] = {}
    for name in sorted(joints):
        below.setdefault(_link(joints[name], "parent"), []).append(name)
    children = {_link(joint, "child") for joint in joints.values()}
    stack = [name for link in below if link not in children for name in below[link]][::-1]
    found: list[str] = []
    while stack and len(found) < len(joints):  # a ring of links, which is refused later, has no end
        found.append(stack.pop())
        stack.extend(reversed(below.get(_link(joints[found[-1]], "child"), [])))
    return found


def _carry_limits(
    leader: ElementTree.Element, first: ElementTree.Element, ratio: float, offset: float
) -> None:
    """Give a joint the range that its leader had; its own effort and velocity stay."""
    given, own = leader.find("limit"), first.find("limit")
    if given is None or own is None:
        return
    ends = sorted(ratio * float(given.get(name, 0.0)) + offset for name in ("lower", "upper"))
    own.set("lower", f"{ends[0]:.15g}")
    own.set("upper", f"{ends[1]:.15g}")


def _offset(mimic: ElementTree.Element) -> float:
    return float(mimic.get("offset", 0.0))


def _tighten(leader: ElementTree.Element, joint: ElementTree.Element, mimic: ElementTree.Element) -> None:
    """Narrow a joint's limits to those of a joint that follows it."""
    own, followed = joint.find("limit"), leader.find("limit")
    if own is None or followed is None or "continuous" in (joint.get("type"), leader.get("type")):
        return
    ratio, offset = float(mimic.get("multiplier", 1.0)), _offset(mimic)
    ends = sorted((float(own.get(name, 0.0)) - offset) / ratio for name in ("lower", "upper"))
    lower = max(float(followed.get("lower", 0.0)), ends[0])
    upper = min(float(followed.get("upper", 0.0)), ends[1])
    followed.set("lower", f"{lower:.15g}")
    followed.set("upper", f"{upper:.15g}")
    given = float(own.get("velocity", 0.0)) / abs(ratio)
    if 0.0 < given < float(followed.get("velocity", 0.0) or np.inf):
        followed.set("velocity", f"{given:.15g}")


def _refuse_held(leader: ElementTree.Element, joint: ElementTree.Element, hand: str) -> None:
    limit = leader.find("limit")
    if limit is None or leader.get("type") == "continuous":
        return
    lower, upper = float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0))
    if not lower < upper:
        name, own = leader.get("name"), joint.get("name")
        raise HandError(
            f"joint '{own}' of hand '{hand}' follows joint '{name}', and leaves it no range "
            f"({lower:g} to {upper:g})",
            remedy=f"correct the limits or the offset of '{own}' in the file, or lock '{name}'",
            joint=own,
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


def _fix(joint: ElementTree.Element, position: float | None) -> float:
    """Turn a joint into a fixed one at a position, deg or mm; return it in rad or m."""
    if joint.get("type") not in ("revolute", "continuous", "prismatic"):
        value = 0.0
    elif position is None:
        value = _nearest_to_zero(joint)
    else:
        value = 1e-3 * position if joint.get("type") == "prismatic" else float(np.radians(position))
    _fix_at(joint, value)
    return value


def _fix_at(joint: ElementTree.Element, value: float) -> None:
    """Turn a joint into a fixed one at a position, rad or m."""
    kind = joint.get("type")
    if kind in ("revolute", "continuous", "prismatic"):
        axis = _numbers(joint.find("axis"), "xyz", (1.0, 0.0, 0.0))
        axis = axis / np.linalg.norm(axis)
        origin = joint.find("origin")
        if origin is None:
            origin = ElementTree.SubElement(joint, "origin", xyz="0 0 0")
        rotation = pinocchio.rpy.rpyToMatrix(_numbers(origin, "rpy", (0.0, 0.0, 0.0)))
        if kind == "prismatic":
            moved = _numbers(origin, "xyz", (0.0, 0.0, 0.0)) + rotation @ (value * axis)
            origin.set("xyz", " ".join(f"{part:.15g}" for part in moved))
        else:
            turned = pinocchio.rpy.matrixToRpy(rotation @ pinocchio.exp3(value * axis))
            origin.set("rpy", " ".join(f"{part:.15g}" for part in turned))
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
