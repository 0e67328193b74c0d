"""An arm read from a URDF: the chain of joints that carries a hand, completed and cut at its last link."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.completion import is_only_seen, name_meshes, parsed_urdf, touch_what_is_seen
from graspbench.hand.files import find_urdf
from graspbench.hand.importing.structure import LinkTree
from graspbench.hand.inertias import complete_inertias
from graspbench.hand.numbers import check_numbers
from graspbench.quiet import captured_output
from graspbench.simulation.arm_parameters import ArmParameters
from graspbench.simulation.inertia import mend_inertias
from graspbench.simulation.mounts.arm_shapes import flange_pose, hull_vertices, placed_bodies

PREFIX = "arm/"
"""Before the names of the arm's links and joints: the hand may have the same."""

MIN_JOINTS = 6
_MIN_COMMON = 3
_FULL_TURN = 2.0 * np.pi
_KINDS = ("revolute", "continuous", "prismatic")


@dataclass(frozen=True, eq=False)
class ArmFile:
    """An arm as it was read.

    Attributes:
        name: Its name.
        urdf: The chain alone; meshes by their full paths, its root link where it stands.
        root: Its root link.
        joints: Its joints, first to last, as in `urdf`.
        tip: Link that carries the hand.
        transform_flange_to_tip: Where the hand is bolted on, z outwards, shape (4, 4).
        slides: Whether each joint slides, shape (n,).
        speed_limits: Shape (n,), rad/s or m/s.
        effort_limits: Shape (n,), N m or N.
        hulls: Vertices of each moving link's convex hull in its own frame, each shape (k, 3), joint by joint.
        bodies: Of each link with shapes what it is called, the joint that moves it (-1: none), and points
            that span it in the frame behind that joint, each shape (k, 3).
    """

    name: str
    urdf: str
    root: str
    joints: tuple[str, ...]
    tip: str
    transform_flange_to_tip: FloatArray
    slides: tuple[bool, ...]
    speed_limits: FloatArray
    effort_limits: FloatArray
    hulls: tuple[FloatArray, ...]
    bodies: tuple[tuple[str, int, FloatArray], ...]


def read_arm(p: ArmParameters) -> ArmFile:
    """Read an arm.

    What the description leaves out is found: the chain of joints, the link that carries the hand, and the
    flange, where that link's shapes end along the last joint's axis.

    Raises:
        HandError: The file cannot be read, or has no chain of six joints or more.
    """
    with _told_of_the_arm():
        source, folders = find_urdf(p.urdf, p.package_dirs, p.name)
        return _read(p, source, folders, source.stat().st_mtime_ns)


@lru_cache(maxsize=4)
def _read(p: ArmParameters, source: Path, folders: tuple[Path, ...], _modified_ns: int) -> ArmFile:
    robot = parsed_urdf(source, p.name)
    if is_only_seen(robot):
        touch_what_is_seen(robot)
    for link in robot.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    tree = LinkTree(robot, p.name)
    roots = [link for link in tree.links if link not in tree.parent]
    if not roots:
        raise HandError(f"the URDF '{source}' of hand '{p.name}' has no link", remedy="check the file")
    base = p.base or roots[0]
    chain = _chain(tree, base, p)
    tip = p.tip or chain[-1][1]
    _cut(robot, tree, base, [link for _, link in chain], tip)
    check_numbers(robot, p.name)
    try:
        name_meshes(robot, source, folders, p.name)
        joints = _completed_joints(robot, [joint for joint, _ in chain if joint in tree.moving], p)
        complete_inertias(robot, p.density_kg_m3, p.name)
        mend_inertias(robot)
        described = _described(robot, base, tip, joints, p)
        kinematic_model(described.urdf)
        return described
    except ValueError as error:  # a number that is none, somewhere in the file
        raise HandError(
            f"the URDF '{source}' of hand '{p.name}' cannot be read ({error})",
            remedy="check the file",
            path=str(source),
        ) from error


def kinematic_model(urdf: str) -> pinocchio.Model:
    """Return Pinocchio's model of an arm's completed URDF; raise ValueError where it reads none."""
    with captured_output():
        return pinocchio.buildModelFromXML(urdf)


@contextmanager
def _told_of_the_arm() -> Iterator[None]:
    """Arms are read by what reads hands: let its sentences speak of an arm."""
    try:
        yield
    except HandError as error:
        words = ("of hand", "of arm"), ("hand '", "arm '"), ("hand.", "arm."), (", or arm.kind=radial", "")
        what, remedy = error.what, error.remedy or ""
        for old, new in words:
            what, remedy = what.replace(old, new), remedy.replace(old, new)
        raise HandError(what, remedy=remedy or None, **error.data) from error


def _chain(tree: LinkTree, base: str, p: ArmParameters) -> list[tuple[str, str]]:
    """Return (joint, link) from below the base to the link that carries the hand."""
    for link in (base, p.tip):
        if link is not None and link not in tree.children:
            raise HandError(
                f"hand '{p.name}' has no link '{link}'",
                remedy=f"choose hand.base and hand.tip among {', '.join(tree.links)}",
                link=link,
            )
    if p.tip is not None:
        way = tree.way(p.tip)
        links = [link for _, link in way]
        if base in links:
            way = way[links.index(base) + 1 :]
        elif way and tree.parent[way[0][1]][1] != base:
            raise HandError(
                f"link '{p.tip}' of hand '{p.name}' does not hang on '{base}'",
                remedy="name another hand.base or hand.tip",
            )
    else:
        way = _common_way(tree, base, p)
    n = sum(joint in tree.moving for joint, _ in way)
    if n < MIN_JOINTS:
        raise HandError(
            f"hand '{p.name}' has {n} joint(s) between '{base}' and '{way[-1][1] if way else base}', and a "
            f"palm is brought to any pose by {MIN_JOINTS} or more",
            remedy="take another arm, or name its links with hand.base and hand.tip",
            joints=n,
        )
    return way


def _common_way(tree: LinkTree, base: str, p: ArmParameters) -> list[tuple[str, str]]:
    """Return the way that all chains of joints have in common, up to the last link that moves."""
    within = tree.below(base)
    ends = [
        link
        for link in within[1:]
        if tree.parent[link][0] in tree.moving
        and not any(tree.parent[below][0] in tree.moving for below in tree.below(link)[1:])
    ]
    ways = [[each for each in tree.way(end) if each[1] in within and each[1] != base] for end in ends]
    common = [each for each in ways[0] if all(each in way for way in ways)] if ways else []
    while common and common[-1][0] not in tree.moving:
        common.pop()
    if len(ends) > 1 and sum(joint in tree.moving for joint, _ in common) < _MIN_COMMON:
        raise HandError(
            f"hand '{p.name}' has {len(ends)} chains of joints that end at {', '.join(ends)}",
            remedy="name the link that carries the hand with hand.tip",
        )
    return common


def _cut(robot: ElementTree.Element, tree: LinkTree, base: str, chain: Sequence[str], tip: str) -> None:
    """Leave the chain and what is fixed to it, in place; what hangs on the tip goes too."""
    kept = {base, *chain}
    for link in tree.below(base)[1:]:
        joint, above = tree.parent[link]
        if above in kept and above != tip and joint not in tree.moving:
            kept.add(link)
    for element in list(robot):
        if element.tag == "link" and element.get("name") in kept:
            continue
        child = element.find("child")
        inside = element.tag == "joint" and child is not None and child.get("link") in kept - {base}
        if not inside:
            robot.remove(element)


def _completed_joints(
    robot: ElementTree.Element, moving: Sequence[str], p: ArmParameters
) -> list[ElementTree.Element]:
    """Return the chain's joints with limits of range, speed and effort, in place."""
    by_name = {joint.get("name"): joint for joint in robot.findall("joint")}
    joints = [by_name[name] for name in moving]
    if p.speed_limits_deg is not None and len(p.speed_limits_deg) != len(joints):
        raise HandError(
            f"hand '{p.name}' has {len(joints)} joints, and hand.speed_limits_deg has "
            f"{len(p.speed_limits_deg)} values",
            remedy="give one for each joint",
        )
    for k, joint in enumerate(joints):
        name, kind = joint.get("name"), joint.get("type")
        if kind not in _KINDS or joint.find("mimic") is not None:
            raise HandError(
                f"joint '{name}' of hand '{p.name}' is {kind} or follows another (mimic)",
                remedy="take an arm of turning and sliding joints that move by themselves",
                joint=name,
            )
        limit = joint.find("limit")
        if limit is None:
            limit = ElementTree.SubElement(joint, "limit")
        if kind == "continuous":
            joint.set("type", "revolute")
            limit.set("lower", repr(-_FULL_TURN))
            limit.set("upper", repr(_FULL_TURN))
        lower, upper = float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0))
        if not lower < upper:
            raise HandError(
                f"joint '{name}' of hand '{p.name}' has no range ({lower:g} to {upper:g})",
                remedy="correct its limits in the file",
                joint=name,
            )
        unit = 1e-3 if kind == "prismatic" else float(np.radians(1.0))
        stated = None if p.speed_limits_deg is None else unit * p.speed_limits_deg[k]
        _complete(limit, "velocity", unit * p.speed_limit_deg, stated)
        _complete(limit, "effort", p.effort_limit_nm)
    return joints


def _complete(limit: ElementTree.Element, key: str, default: float, stated: float | None = None) -> None:
    given = float(limit.get(key, 0.0))
    if stated is not None:
        limit.set(key, repr(stated))
    elif not 0.0 < given < np.inf:
        limit.set(key, repr(default))


def _described(
    robot: ElementTree.Element, base: str, tip: str, joints: list[ElementTree.Element], p: ArmParameters
) -> ArmFile:
    shapes = {link.get("name", ""): hull_vertices(link, p.name) for link in robot.findall("link")}
    flange = flange_pose(robot, joints, tip, shapes[tip], p)
    hulls = []
    for joint in joints:
        child = joint.find("child")
        hulls.append(shapes["" if child is None else child.get("link", "")])
    bodies = tuple(placed_bodies(robot, joints, shapes))
    limits = [joint.find("limit") for joint in joints]
    _prefix_names(robot)
    return ArmFile(
        name=p.name,
        urdf=ElementTree.tostring(robot, encoding="unicode"),
        root=PREFIX + base,
        joints=tuple(joint.get("name", "") for joint in joints),
        tip=PREFIX + tip,
        transform_flange_to_tip=flange,
        slides=tuple(joint.get("type") == "prismatic" for joint in joints),
        speed_limits=np.array([float(limit.get("velocity", 0.0)) for limit in limits if limit is not None]),
        effort_limits=np.array([float(limit.get("effort", 0.0)) for limit in limits if limit is not None]),
        hulls=tuple(hulls),
        bodies=bodies,
    )


def _prefix_names(robot: ElementTree.Element) -> None:
    for element in robot:
        element.set("name", PREFIX + element.get("name", ""))
        for end in (element.find("parent"), element.find("child")):
            if end is not None:
                end.set("link", PREFIX + end.get("link", ""))
