"""What carries the hand about: here a wrist of six joints that floats in the world."""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

import numpy as np
import pybullet
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.model import HandModel
from graspbench.simulation.inertia import mend_inertias

WRIST_JOINTS = ("wrist_x", "wrist_y", "wrist_z", "wrist_rx", "wrist_ry", "wrist_rz")
_AXES = ("1 0 0", "0 1 0", "0 0 1") * 2
# Light against any object, heavy against the solver's round-off.
_MASS_KG, _INERTIA_KGM2 = 0.2, 1e-3
_FORCE = 1e4
_POSITION_GAIN = 0.3


class Mount(Protocol):
    """What a hand is mounted on: it brings the palm where it is wanted."""

    @property
    def base_to_world(self) -> FloatArray:
        """Pose of the mounted hand's fixed base, shape (4, 4)."""
        ...

    @property
    def solver_iterations(self) -> int:
        """Least number of the solver's iterations in which forces get through its chain of joints."""
        ...

    @property
    def tilt_direction(self) -> float:
        """Which way the wrist tilts after the lift: 1, approach turning upwards, or -1."""
        ...

    def urdf(self) -> str:
        """Return the URDF of mount and hand in one; its mesh files are absolute paths."""
        ...

    def attach(self, client: int, body: int, joint_ids: Mapping[str, int]) -> None:
        """Take over the mount's joints of a body that was loaded from `urdf`, and put them at the start."""
        ...

    def drive(self, transform_palm_to_world: FloatArray, time_step_s: float) -> None:
        """Set the palm's goal for the end of the next step, shape (4, 4)."""
        ...

    def palm_pose(self) -> FloatArray:
        """Return the palm's real transform_palm_to_world, shape (4, 4)."""
        ...


class FloatingWrist:
    """Three sliding and three turning joints with motors that are stronger than anything they carry.

    Args:
        hand: The hand.
        transform_palm_to_world: Where the palm is first, shape (4, 4).
        tilt_axis: World direction, shape (3,), about which the wrist can turn without limit.
    """

    def __init__(self, hand: HandModel, transform_palm_to_world: FloatArray, tilt_axis: FloatArray) -> None:
        self._hand = hand
        root_to_palm = np.linalg.inv(hand.transform_palm_to_root)
        root = transform_palm_to_world @ root_to_palm
        self._base = np.eye(4)
        self._base[:3, :3] = _frame_along(tilt_axis)
        self._base[:3, 3] = root[:3, 3]
        self._world_to_base = np.linalg.inv(self._base)
        wrist_to_root = np.eye(4)
        wrist_to_root[:3, :3] = root[:3, :3].T @ self._base[:3, :3]
        self._rotation_root_to_wrist = wrist_to_root[:3, :3].T
        self._wrist_to_palm = root_to_palm @ wrist_to_root
        self._palm_to_wrist = np.linalg.inv(self._wrist_to_palm)
        self._wanted = transform_palm_to_world.copy()
        self._goal = self._coordinates(transform_palm_to_world)
        self._still = False
        self._client, self._body = -1, -1
        self._joint_ids: list[int] = []

    @property
    def base_to_world(self) -> FloatArray:
        """Pose of the wrist's fixed base, shape (4, 4)."""
        return self._base

    @property
    def solver_iterations(self) -> int:
        """Its joints weigh next to nothing: as few iterations as the fingers need."""
        return 1

    @property
    def tilt_direction(self) -> float:
        """Which way the wrist tilts after the lift: it has no arm that would be in the way."""
        return 1.0

    def urdf(self) -> str:
        """Return the URDF of wrist and hand."""
        return mounted_urdf(self._hand, self._rotation_root_to_wrist)

    def attach(self, client: int, body: int, joint_ids: Mapping[str, int]) -> None:
        """Take over the wrist's joints of a loaded body, and put them at the start."""
        self._client, self._body = client, body
        self._joint_ids = [joint_ids[name] for name in WRIST_JOINTS]
        for joint, value in zip(self._joint_ids, self._goal, strict=True):
            pybullet.resetJointState(body, joint, value, 0.0, physicsClientId=client)

    def drive(self, transform_palm_to_world: FloatArray, time_step_s: float) -> None:
        """Set the palm's goal for the end of the next step; the wrist's motors reach it."""
        if self._still and np.array_equal(transform_palm_to_world, self._wanted):
            return  # its motors hold the goal they have
        self._wanted = transform_palm_to_world.copy()
        goal = self._coordinates(transform_palm_to_world)
        goal[3:] += 2 * np.pi * np.round((self._goal[3:] - goal[3:]) / (2 * np.pi))
        speed = (goal - self._goal) / time_step_s
        self._goal, self._still = goal, not speed.any()
        pybullet.setJointMotorControlArray(
            self._body,
            self._joint_ids,
            pybullet.POSITION_CONTROL,
            targetPositions=goal.tolist(),
            targetVelocities=speed.tolist(),
            forces=[_FORCE] * 6,
            positionGains=[_POSITION_GAIN] * 6,
            velocityGains=[1.0] * 6,
            physicsClientId=self._client,
        )

    def palm_pose(self) -> FloatArray:
        """Return transform_palm_to_world, shape (4, 4), from the wrist's real joints."""
        states = pybullet.getJointStates(self._body, self._joint_ids, physicsClientId=self._client)
        wrist = wrist_pose(np.array([s[0] for s in states]))
        pose: FloatArray = self._base @ wrist @ self._palm_to_wrist
        return pose

    def _coordinates(self, transform_palm_to_world: FloatArray) -> FloatArray:
        return wrist_coordinates(self._world_to_base @ transform_palm_to_world @ self._wrist_to_palm)


def mounted_urdf(hand: HandModel, rotation_root_to_wrist: FloatArray) -> str:
    """Return the hand's URDF with three sliding and three turning joints before its root link.

    Mesh files become absolute paths, so the text may be stored anywhere.

    Args:
        hand: The hand.
        rotation_root_to_wrist: How the hand's root link is fixed to the last wrist link, shape (3, 3).

    Raises:
        HandError: A mesh file of the URDF cannot be found.
    """
    robot, root = hand_robot(hand)
    mount = ElementTree.Element("robot", robot.attrib)
    mount.append(light_link("wrist_base"))
    parent = "wrist_base"
    for name, axis in zip(WRIST_JOINTS, _AXES, strict=True):
        mount.append(light_link(f"{name}_link"))
        kind = "revolute" if "_r" in name else "prismatic"
        joint = _joint(name, kind, parent, f"{name}_link", axis)
        mount.append(joint)
        parent = f"{name}_link"
    fixed = _joint("wrist_mount", "fixed", parent, root, None)
    rpy = Rotation.from_matrix(rotation_root_to_wrist).as_euler("xyz")
    ElementTree.SubElement(fixed, "origin", xyz="0 0 0", rpy=" ".join(f"{angle:.15g}" for angle in rpy))
    mount.append(fixed)
    mount.extend(robot)
    return ElementTree.tostring(mount, encoding="unicode")


def hand_robot(hand: HandModel) -> tuple[ElementTree.Element, str]:
    """Return the hand's URDF for PyBullet: absolute paths of meshes, possible inertias; and its root link.

    Raises:
        HandError: A mesh file of the URDF cannot be found.
    """
    robot = ElementTree.parse(hand.urdf_path).getroot()
    for mesh in robot.iter("mesh"):
        mesh.set("filename", str(_mesh_path(hand, mesh.get("filename", ""))))
    mend_inertias(robot)
    children = {
        _attribute(joint, "child") for joint in robot.iter("joint") if joint.find("child") is not None
    }
    root = next(link.get("name", "") for link in robot.findall("link") if link.get("name") not in children)
    return robot, root


def wrist_coordinates(pose_wrist_in_base: FloatArray) -> FloatArray:
    """Return the six wrist joints of a pose of the last wrist link in the base frame, shape (6,)."""
    r = pose_wrist_in_base
    second = math.atan2(r[0, 2], math.hypot(r[0, 0], r[0, 1]))
    if math.hypot(r[0, 0], r[0, 1]) > 1e-9:
        first, third = math.atan2(-r[1, 2], r[2, 2]), math.atan2(-r[0, 1], r[0, 0])
    else:  # gimbal lock: one of the two does for both
        first, third = 0.0, math.atan2(r[1, 0], r[1, 1])
    return np.array([r[0, 3], r[1, 3], r[2, 3], first, second, third])


def wrist_pose(coordinates: FloatArray) -> FloatArray:
    """Return the pose of the last wrist link in the base frame, shape (4, 4), for the six joints."""
    (a, b, c), (sa, sb, sc) = np.cos(coordinates[3:]), np.sin(coordinates[3:])
    return np.array(
        [
            [b * c, -b * sc, sb, coordinates[0]],
            [a * sc + sa * sb * c, a * c - sa * sb * sc, -sa * b, coordinates[1]],
            [sa * sc - a * sb * c, sa * c + a * sb * sc, a * b, coordinates[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _mesh_path(hand: HandModel, name: str) -> Path:
    if name.startswith("package://"):
        candidates = [folder / name.removeprefix("package://") for folder in hand.package_dirs]
    else:
        plain = Path(name.removeprefix("file://"))
        candidates = [plain if plain.is_absolute() else hand.urdf_path.parent / plain]
    for path in candidates:
        if path.is_file():
            return path
    raise HandError(
        f"mesh '{name}' of hand '{hand.name}' is not found", remedy="check hand.package_dirs", mesh=name
    )


def light_link(name: str) -> ElementTree.Element:
    """Return a link without a shape that weighs little."""
    link = ElementTree.Element("link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value=str(_MASS_KG))
    moments = {"ixx": _INERTIA_KGM2, "iyy": _INERTIA_KGM2, "izz": _INERTIA_KGM2}
    products = {"ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
    ElementTree.SubElement(inertial, "inertia", {k: str(v) for k, v in (moments | products).items()})
    return link


def _joint(name: str, kind: str, parent: str, child: str, axis: str | None) -> ElementTree.Element:
    joint = ElementTree.Element("joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    if axis is not None:
        ElementTree.SubElement(joint, "axis", xyz=axis)
        ElementTree.SubElement(joint, "limit", lower="-10", upper="10", effort="10000", velocity="100")
    return joint


def _attribute(joint: ElementTree.Element, tag: str) -> str:
    part = joint.find(tag)
    return "" if part is None else part.get("link", "")


def _frame_along(axis: FloatArray) -> FloatArray:
    """Return a rotation whose first column is a direction, shape (3, 3)."""
    x = axis / np.linalg.norm(axis)
    y = np.cross(np.eye(3)[int(np.argmin(np.abs(x)))], x)
    y /= np.linalg.norm(y)
    return np.column_stack((x, y, np.cross(x, y)))
