"""Collision shapes that replace those of a URDF, where these do not follow the real hand."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence

from graspbench.errors import HandError
from graspbench.hand.parameters import CollisionShape

SIZES = {"box": 3, "cylinder": 2, "sphere": 1}


def replace_collision(
    robot: ElementTree.Element, collision: Mapping[str, Sequence[CollisionShape]], hand: str
) -> None:
    """Replace the collision shapes of some links of a URDF, in place.

    Args:
        robot: The URDF.
        collision: The new shapes, by link.
        hand: Name of the hand, for error messages.

    Raises:
        HandError: A link is unknown, or a shape's size has the wrong length.
    """
    links = {link.get("name", ""): link for link in robot.iter("link")}
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
