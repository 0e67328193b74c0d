"""Where an arm's shapes are, and its flange: where those of its last link end along the last joint's axis."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from itertools import product

import coal
import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.directions import even_directions
from graspbench.hand.hulls import hull_of
from graspbench.hand.importing.arms import end_of
from graspbench.simulation.arm_parameters import ArmParameters

_ASIDE_M = 0.005
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
_DIRECTIONS = even_directions(100)


def flange_pose(
    robot: ElementTree.Element,
    joints: list[ElementTree.Element],
    tip: str,
    points: FloatArray,
    p: ArmParameters,
) -> FloatArray:
    """Return the flange's pose in the tip link, shape (4, 4): as stated, else found."""
    pose = np.eye(4)
    if p.flange_rpy_deg is not None:
        pose[:3, :3] = Rotation.from_euler("xyz", p.flange_rpy_deg, degrees=True).as_matrix()
    else:
        pose[:3, :3] = _frame_along(_outwards(robot, joints, tip, points))
    if p.flange_xyz_m is not None:
        pose[:3, 3] = p.flange_xyz_m
    elif len(points):
        pose[:3, 3] = max(0.0, float((points @ pose[:3, 2]).max())) * pose[:3, 2]
    return pose


def _outwards(
    robot: ElementTree.Element, joints: list[ElementTree.Element], tip: str, points: FloatArray
) -> FloatArray:
    """Return the last joint's axis in the tip link, shape (3,), away from the joint before it."""
    last = joints[-1]
    axis_element = last.find("axis")
    axis = _numbers("1 0 0" if axis_element is None else axis_element.get("xyz", "1 0 0"))
    axis /= np.linalg.norm(axis)
    rotation, offset = _origin(last)
    along = float(rotation @ axis @ offset)  # of the joint's place in the link before it
    if abs(along) < _ASIDE_M and len(points):
        along = float((points @ axis).mean())
    outwards = axis if along >= 0.0 else -axis
    by_child = {end_of(joint, "child"): joint for joint in robot.findall("joint")}
    link, turn = tip, np.eye(3)
    while by_child[link] is not last:  # fixed joints between the last one that moves and the tip
        turn = _origin(by_child[link])[0] @ turn
        link = end_of(by_child[link], "parent")
    return np.asarray(turn.T @ outwards)


def _frame_along(z: FloatArray) -> FloatArray:
    """Return a rotation whose third column is a direction; the first one is near x, or y, shape (3, 3)."""
    start = np.eye(3)[0] if abs(z[0]) < 0.9 else np.eye(3)[1]
    x = start - (start @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(z, x), z))


def _origin(element: ElementTree.Element) -> tuple[FloatArray, FloatArray]:
    """Return rotation, shape (3, 3), and position, shape (3,), of what has an origin."""
    origin = element.find("origin")
    xyz, rpy = (
        ("0 0 0", "0 0 0") if origin is None else (origin.get("xyz", "0 0 0"), origin.get("rpy", "0 0 0"))
    )
    return Rotation.from_euler("xyz", _numbers(rpy)).as_matrix(), _numbers(xyz)


def _numbers(text: str) -> FloatArray:
    return np.array([float(word) for word in text.split()])


def placed_bodies(
    robot: ElementTree.Element, joints: list[ElementTree.Element], shapes: Mapping[str, FloatArray]
) -> list[tuple[str, int, FloatArray]]:
    """Return, for each link with shapes, its name, the joint that moves it, and its points in its frame.

    Args:
        robot: The chain alone; its root stands.
        joints: The joints that move, first to last.
        shapes: Points of each link's shapes in the link's frame, each shape (n, 3).

    Returns:
        The joint as its place among ``joints``, -1 for what stands; points in the frame of the link that the
        joint moves, those of what stands in the root's.
    """
    by_child = {end_of(joint, "child"): joint for joint in robot.findall("joint")}
    found = []
    for name, own in shapes.items():
        link, points = name, own
        while link in by_child and by_child[link] not in joints:
            rotation, offset = _origin(by_child[link])
            points = points @ rotation.T + offset
            link = end_of(by_child[link], "parent")
        stage = joints.index(by_child[link]) if link in by_child else -1
        if len(points):
            found.append((f"link '{name}'", stage, points))
    return found


def hull_vertices(link: ElementTree.Element, arm: str) -> FloatArray:
    """Return the vertices of the hull of a link's shapes in its own frame, shape (n, 3); none: (0, 3)."""
    found = [np.zeros((0, 3))]
    for shape in link.findall("collision"):
        rotation, offset = _origin(shape)
        kind = next(iter(shape.find("geometry") or ()), None)
        if kind is None:
            continue
        if kind.tag == "mesh":
            name = kind.get("filename", "")
            try:
                scale = _numbers(kind.get("scale", "1 1 1"))
                points = np.asarray(coal.MeshLoader().load(name, scale).vertices())
            except (RuntimeError, ValueError, MemoryError) as error:
                raise HandError(
                    f"the collision mesh '{name}' of hand '{arm}' cannot be read ({error})",
                    remedy="save it as STL, OBJ or DAE",
                    mesh=name,
                ) from error
        elif kind.tag == "box":
            points = _CORNERS * 0.5 * _numbers(kind.get("size", "0 0 0"))
        elif kind.tag == "sphere":
            points = float(kind.get("radius", 0.0)) * _DIRECTIONS
        else:
            radius, length = float(kind.get("radius", 0.0)), float(kind.get("length", 0.0))
            rim, end = radius * _DIRECTIONS * [1.0, 1.0, 0.0], np.array([0.0, 0.0, 0.5 * length])
            points = np.vstack((rim + end, rim - end))
        found.append(points @ rotation.T + offset)
    points = np.vstack(found)
    hull = hull_of(points) if len(points) > 3 else None
    return points if hull is None else hull.corners
