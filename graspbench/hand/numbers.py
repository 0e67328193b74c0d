"""The numbers of a URDF: each is looked at once, so that whatever reads it later finds what it can use."""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import HandError, shown

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_UNLIMITED = re.compile(r"[+-]?inf(inity)?", re.IGNORECASE)
_MAX_LENGTH_M, _MAX_MASS_KG, _MAX_ANGLE_RAD = 100.0, 1e4, 1e4
_MIN_AXIS, _MIN_SIZE_M, _MIN_SCALE = 1e-6, 1e-7, 1e-9
_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_SIZES: Mapping[str, tuple[tuple[str, int], ...]] = {
    "box": (("size", 3),),
    "sphere": (("radius", 1),),
    "cylinder": (("radius", 1), ("length", 1)),
    "capsule": (("radius", 1), ("length", 1)),
    "mesh": (),
}


def check_numbers(robot: ElementTree.Element, hand: str) -> None:
    """Refuse a URDF with numbers that no hand has; make axes unit vectors and leave out empty shapes.

    Only what touches is looked at, not what is seen.

    Args:
        robot: The URDF; axes that are no unit vectors are made so, in place.
        hand: Name of the hand, for error messages.

    Raises:
        HandError: A number is missing, not finite, or beyond any hand's.
    """
    for link in robot.iter("link"):
        _check_link(link, hand)
    for joint in robot.findall("joint"):
        _check_joint(joint, hand)


def _check_link(link: ElementTree.Element, hand: str) -> None:
    where = f"link '{link.get('name')}' of hand '{hand}'"
    inertial = link.find("inertial")
    if inertial is not None:
        _check_origin(inertial, where)
        for element in inertial.findall("mass"):
            _number(element, "value", where, "0", most=_MAX_MASS_KG)
        for element in inertial.findall("inertia"):
            for name in _INERTIA:
                _number(element, name, where, "0", most=_MAX_MASS_KG)
    for collision in link.findall("collision"):
        geometry = collision.find("geometry")
        shape = None if geometry is None else next(iter(geometry), None)
        if shape is None:
            link.remove(collision)  # nothing that touches; readers differ in what they make of it
            continue
        _check_origin(collision, where)
        _check_shape(shape, where)


def _check_shape(shape: ElementTree.Element, where: str) -> None:
    if shape.tag not in _SIZES:
        raise HandError(
            f"{where} has the shape {shown(shape.tag)}",
            remedy=f"take one of {', '.join(_SIZES)}",
        )
    for key, count in _SIZES[shape.tag]:
        values = _numbers(shape, key, where, count, None, most=_MAX_LENGTH_M)
        if not np.all(values >= _MIN_SIZE_M):
            raise _refusal(shape, key, where, "give sizes above 0, in metres, or take the shape out")
    if shape.tag == "mesh":
        scale = _numbers(shape, "scale", where, 3, "1 1 1", most=_MAX_ANGLE_RAD)
        if not np.all(np.abs(scale) >= _MIN_SCALE):
            raise _refusal(shape, "scale", where, "give three factors that are not 0")


def _check_joint(joint: ElementTree.Element, hand: str) -> None:
    where = f"joint '{joint.get('name')}' of hand '{hand}'"
    _check_origin(joint, where)
    axis = joint.find("axis")
    if axis is not None and joint.get("type") != "fixed":
        direction = _numbers(axis, "xyz", where, 3, "1 0 0", most=np.inf)
        largest = float(np.abs(direction).max())
        if largest < _MIN_AXIS:
            raise _refusal(axis, "xyz", where, "give the direction that it turns about or slides along")
        length = largest * float(np.linalg.norm(direction / largest))
        if abs(length - 1.0) > _MIN_AXIS:
            axis.set("xyz", " ".join(f"{value:.12g}" for value in direction / length))
    most = _MAX_LENGTH_M if joint.get("type") == "prismatic" else _MAX_ANGLE_RAD
    for limit in joint.findall("limit"):
        for key in ("lower", "upper"):
            _number(limit, key, where, "0", most=most)
        for key in ("effort", "velocity"):
            if not _UNLIMITED.fullmatch(limit.get(key, "0").strip()):
                _number(limit, key, where, "0", most=np.inf)
    for mimic in joint.findall("mimic"):
        _number(mimic, "multiplier", where, "1", most=np.inf)
        _number(mimic, "offset", where, "0", most=most)


def _check_origin(element: ElementTree.Element, where: str) -> None:
    for origin in element.findall("origin"):
        _numbers(origin, "xyz", where, 3, "0 0 0", most=_MAX_LENGTH_M)
        _numbers(origin, "rpy", where, 3, "0 0 0", most=_MAX_ANGLE_RAD)


def _number(element: ElementTree.Element, key: str, where: str, default: str, *, most: float) -> float:
    return float(_numbers(element, key, where, 1, default, most=most)[0])


def _numbers(
    element: ElementTree.Element, key: str, where: str, count: int, default: str | None, *, most: float
) -> FloatArray:
    """Return an attribute's numbers; raise where they are not so many, or not finite, or beyond a bound."""
    words = element.get(key, default or "").split()
    if len(words) != count or not all(_NUMBER.fullmatch(word) for word in words):
        raise _refusal(element, key, where, f"give {_COUNTS[count]}")
    values = np.array([float(word) for word in words])
    if not np.all(np.isfinite(values)) or np.any(np.abs(values) > most):
        limit = f" of at most {most:g}" if np.isfinite(most) else ", not too large to compute with"
        raise _refusal(element, key, where, f"give {_COUNTS[count]}{limit}")
    return values


_COUNTS = {1: "a number", 3: "three numbers"}


def _refusal(element: ElementTree.Element, key: str, where: str, remedy: str) -> HandError:
    given = element.get(key)
    has = (
        f"no '{key}' in its '{element.tag}'"
        if given is None
        else (f"{shown(given)} as '{key}' of its '{element.tag}'")
    )
    return HandError(f"{where} has {has}", remedy=f"{remedy}, in the file")
