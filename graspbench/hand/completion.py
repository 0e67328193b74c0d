"""What published hand descriptions leave out, filled in once for the planners and for the simulation.

Both read the same completed URDF: meshes by absolute paths, nothing that is only seen, locked joints fixed,
limits of effort and velocity, inertias of all links, and a frame at the centre of each fingertip.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from graspbench.errors import HandError
from graspbench.hand.files import SCHEME
from graspbench.hand.inertias import complete_inertias
from graspbench.hand.locking import lock_joints
from graspbench.hand.numbers import check_numbers
from graspbench.hand.overrides import replace_collision
from graspbench.hand.parameters import FingerDescription, HandParameters


def completed_description(
    path: Path, package_dirs: tuple[Path, ...], parameters: HandParameters
) -> tuple[ElementTree.Element, tuple[FingerDescription, ...]]:
    """Return a hand's completed URDF, and its fingers as they are in it.

    Args:
        path: The URDF.
        package_dirs: Folders its ``package://`` references start from.
        parameters: The hand's description.

    Raises:
        HandError: The file is no URDF, names a mesh that is not there, or has joints that cannot be used.
    """
    hand = parameters.name
    robot = parsed_urdf(path, hand)
    try:
        fingers = _complete(robot, path, package_dirs, parameters)
    except ValueError as error:  # a number that is none, somewhere in the file
        raise HandError(
            f"the URDF '{path}' of hand '{hand}' cannot be read ({error})",
            remedy="check the file",
            path=str(path),
        ) from error
    return robot, fingers


def _complete(
    robot: ElementTree.Element, path: Path, package_dirs: tuple[Path, ...], parameters: HandParameters
) -> tuple[FingerDescription, ...]:
    hand = parameters.name
    if is_only_seen(robot):
        touch_what_is_seen(robot)
    for link in robot.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    replace_collision(robot, parameters.collision, hand)
    check_numbers(robot, hand)
    name_meshes(robot, path, package_dirs, hand)
    lock_joints(robot, parameters)
    _complete_limits(robot, parameters)
    fingers = tuple(_with_centre(robot, finger, hand) for finger in parameters.chains)
    complete_inertias(robot, parameters.density_kg_m3, hand)
    return fingers


def is_only_seen(robot: ElementTree.Element) -> bool:
    """Tell whether no link has a collision shape, though some have shapes that are seen."""
    return robot.find("link/collision") is None and robot.find("link/visual") is not None


def touch_what_is_seen(robot: ElementTree.Element) -> None:
    """Let the shapes that are seen stand for the collision shapes, in place."""
    for link in robot.iter("link"):
        for visual in link.findall("visual"):
            collision = ElementTree.SubElement(link, "collision")
            collision.extend(part for part in visual if part.tag in ("origin", "geometry"))


def add_tip_spheres(
    robot: ElementTree.Element, fingers: Sequence[FingerDescription], radius_m: float
) -> None:
    """Give fingertips that have none their sphere, in place, so that the simulation touches with it too."""
    links = {link.get("name"): link for link in robot.iter("link")}
    for finger in fingers:
        collision = ElementTree.SubElement(links[finger.tip], "collision")
        geometry = ElementTree.SubElement(collision, "geometry")
        ElementTree.SubElement(geometry, "sphere", radius=f"{radius_m:.12g}")


def parsed_urdf(path: Path, hand: str) -> ElementTree.Element:
    """Return the root of a URDF file; raise HandError where it is none."""
    try:
        robot = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, OSError) as error:
        raise HandError(
            f"the URDF '{path}' of hand '{hand}' cannot be read ({error})",
            remedy="check the file",
            path=str(path),
        ) from error
    if robot.tag != "robot":
        raise HandError(
            f"the file '{path}' of hand '{hand}' is no URDF (its root is '{robot.tag}')",
            remedy="set hand.urdf to a URDF file; expand a xacro file first",
            path=str(path),
        )
    return robot


def name_meshes(robot: ElementTree.Element, path: Path, package_dirs: tuple[Path, ...], hand: str) -> None:
    """Name the collision meshes by their full paths: the text is going to live in another folder."""
    for mesh in robot.iter("mesh"):
        name = mesh.get("filename", "")
        plain = Path(name.removeprefix("file://"))
        folders: tuple[Path, ...] = (path.parent,)
        if name.startswith(SCHEME):
            plain, folders = Path(name.removeprefix(SCHEME)), package_dirs
        places = [(folder / plain).resolve() for folder in folders]
        found = next((place for place in places if place.is_file()), None)
        if found is None:
            raise HandError(
                f"the collision mesh '{name}' of hand '{hand}' is not found",
                remedy=(
                    "put the folder that holds its package into hand.package_dirs"
                    if name.startswith(SCHEME)
                    else f"put it where the URDF says, from {path.parent} on"
                ),
                mesh=name,
            )
        mesh.set("filename", str(found))


def _complete_limits(robot: ElementTree.Element, parameters: HandParameters) -> None:
    """Set limits of effort and velocity that are 0 or missing: published files mean "not given"."""
    defaults = {
        "effort": parameters.effort_limit_nm,
        "velocity": float(np.radians(parameters.velocity_limit_deg)),
    }
    for joint in robot.iter("joint"):
        limit = joint.find("limit")
        if limit is None or joint.get("type") not in ("revolute", "prismatic"):
            continue
        for name, default in defaults.items():
            given = float(limit.get(name, 0.0))
            if not 0.0 < given < np.inf:
                limit.set(name, f"{default:.12g}")


def _with_centre(robot: ElementTree.Element, finger: FingerDescription, hand: str) -> FingerDescription:
    """Return the finger with a frame of its own at the tip's centre, if this is not its link's origin."""
    if not any(finger.tip_xyz_m):
        return finger
    if finger.tip not in {link.get("name") for link in robot.iter("link")}:
        raise HandError(
            f"hand '{hand}' has no link '{finger.tip}'", remedy="name the tip's link", link=finger.tip
        )
    name = f"{finger.name}_tip_centre"
    ElementTree.SubElement(robot, "link", name=name)
    joint = ElementTree.SubElement(robot, "joint", name=f"{name}_fixed", type="fixed")
    ElementTree.SubElement(joint, "parent", link=finger.tip)
    ElementTree.SubElement(joint, "child", link=name)
    ElementTree.SubElement(joint, "origin", xyz=" ".join(f"{v:.12g}" for v in finger.tip_xyz_m), rpy="0 0 0")
    return replace(finger, tip=name)
