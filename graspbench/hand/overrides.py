"""Collision shapes that replace those of a URDF, where these do not follow the real hand."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from graspbench.errors import HandError
from graspbench.hand.files import SCHEME
from graspbench.hand.parameters import CollisionShape

SIZES = {"box": 3, "cylinder": 2, "sphere": 1}


def replace_collision(
    path: Path,
    package_dirs: tuple[Path, ...],
    collision: dict[str, tuple[CollisionShape, ...]],
    hand: str,
) -> str:
    """Return a URDF's text with the collision shapes of some links replaced.

    Args:
        path: The URDF.
        package_dirs: Folders its ``package://`` references start from.
        collision: The new shapes, by link.
        hand: Name of the hand, for error messages.

    Raises:
        HandError: The file is no XML, a link is unknown, or a shape's size has the wrong length.
    """
    try:
        tree = ElementTree.parse(path)
    except (ElementTree.ParseError, OSError) as error:
        raise HandError(
            f"the URDF '{path}' of hand '{hand}' cannot be read ({error})",
            remedy="check the file",
            path=str(path),
        ) from error
    links = {link.get("name", ""): link for link in tree.getroot().iter("link")}
    for name, shapes in collision.items():
        if name not in links:
            raise HandError(
                f"hand '{hand}' has no link '{name}' to give collision shapes to",
                remedy=f"choose one of {', '.join(links)}",
                link=name,
            )
        for old in links[name].findall("collision"):
            links[name].remove(old)
        for shape in shapes:
            links[name].append(_element(shape, name, hand))
    for mesh in tree.getroot().iter("mesh"):
        file = mesh.get("filename", "")
        # The text is going to live in another folder, so meshes are named by their full paths.
        folders = package_dirs if file.startswith(SCHEME) else (path.parent,)
        places = [(folder / file.removeprefix(SCHEME)).resolve() for folder in folders]
        mesh.set("filename", str(next((place for place in places if place.is_file()), file)))
    return ElementTree.tostring(tree.getroot(), encoding="unicode")


def _element(shape: CollisionShape, link: str, hand: str) -> ElementTree.Element:
    if len(shape.size_m) != SIZES[shape.kind] or min(shape.size_m) <= 0.0:
        raise HandError(
            f"a collision {shape.kind} of link '{link}' of hand '{hand}' has the size {list(shape.size_m)}",
            remedy=f"give {SIZES[shape.kind]} positive lengths in metres",
        )
    numbers = [f"{value:.12g}" for value in shape.size_m]
    element = ElementTree.Element("collision")
    ElementTree.SubElement(element, "origin", xyz=" ".join(f"{v:.12g}" for v in shape.xyz_m), rpy="0 0 0")
    geometry = ElementTree.SubElement(element, "geometry")
    if shape.kind == "box":
        ElementTree.SubElement(geometry, "box", size=" ".join(numbers))
    elif shape.kind == "cylinder":
        ElementTree.SubElement(geometry, "cylinder", radius=numbers[0], length=numbers[1])
    else:
        ElementTree.SubElement(geometry, "sphere", radius=numbers[0])
    return element
