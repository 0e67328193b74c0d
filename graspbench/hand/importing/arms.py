"""Hands that come on an arm: the hand alone, cut off at its palm."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path

from graspbench.errors import HandError
from graspbench.hand.completion import is_only_seen, name_meshes, parsed_urdf, touch_what_is_seen
from graspbench.hand.files import find_urdf
from graspbench.hand.importing.structure import find_structure

_ARM_JOINTS = 3
"""So many joints between root and palm are an arm; fewer are a wrist, which stays."""


def without_arm(
    path: Path, name: str, folder: Path, palm: str | None = None, package_dirs: Sequence[str] = ()
) -> Path:
    """Return a file of the hand alone; the given one where it has no arm.

    Args:
        path: The URDF.
        name: What to call the hand.
        folder: Where to write.
        palm: The palm's link, if it is known.
        package_dirs: Folders to look for ``package://`` files in.

    Raises:
        HandError: The file cannot be read, or has no two fingers.
    """
    source, folders = find_urdf(str(path), tuple(package_dirs), name)
    robot = parsed_urdf(source, name)
    structure = find_structure(robot, name, palm)
    if len(structure.wrist) < _ARM_JOINTS:
        return source
    parents = {end_of(joint, "child"): end_of(joint, "parent") for joint in robot.findall("joint")}
    kept = {link.get("name", "") for link in robot.findall("link")}
    kept = {link for link in kept if structure.palm in _above(link, parents)}
    if is_only_seen(robot):
        touch_what_is_seen(robot)
    for link in robot.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        if link.get("name") not in kept:
            robot.remove(link)
    for joint in robot.findall("joint"):
        if end_of(joint, "parent") not in kept:
            robot.remove(joint)
    name_meshes(robot, source, folders, name)
    for other in [each for each in robot if each.tag not in ("link", "joint")]:
        robot.remove(other)
    target = folder / f"{name}.urdf"
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(ElementTree.tostring(robot, encoding="unicode") + "\n", encoding="utf-8")
    except OSError as error:
        raise HandError(
            f"the hand without its arm cannot be written to '{target}' ({error.strerror})",
            remedy="give a folder that can be written with --config-dir",
        ) from error
    return target


def end_of(joint: ElementTree.Element, end: str) -> str:
    """Return the link at an end of a joint, ``parent`` or ``child``; empty where none is named."""
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _above(link: str, parents: dict[str, str]) -> list[str]:
    """Return a link and those above it."""
    found = [link]
    while link in parents and parents[link] not in found:
        link = parents[link]
        found.append(link)
    return found
