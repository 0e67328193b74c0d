"""What a mount is: it carries the hand's palm to where it is wanted."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from graspbench.arrays import FloatArray


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
        """Take over the mount's joints of a body that was loaded from `urdf`, and put them at the start.

        Args:
            client: PyBullet's number of the world.
            body: The loaded body.
            joint_ids: Number of each joint by its name in the URDF.
        """
        ...

    def drive(self, transform_palm_to_world: FloatArray, time_step_s: float) -> None:
        """Set the palm's goal for the end of the next step, shape (4, 4).

        Raises:
            SimulationError: The mount cannot get there.
        """
        ...

    def palm_pose(self) -> FloatArray:
        """Return the palm's real transform_palm_to_world, shape (4, 4)."""
        ...


@dataclass(frozen=True)
class PalmTask:
    """What a mount is chosen and placed for.

    Attributes:
        grasping: Pose of the palm at the grasp, transform_palm_to_world, shape (4, 4).
        object_position: The object's centre in the world, shape (3,).
        tilt_axis: World direction about which the wrist will tilt, shape (3,).
        poses: For each direction of the tilt, 1 and -1, what the palm will pass,
            transform_palm_to_world, shape (n, 4, 4), and times, shape (n,), s; all begin alike.
    """

    grasping: FloatArray
    object_position: FloatArray
    tilt_axis: FloatArray
    poses: Mapping[float, tuple[FloatArray, FloatArray]]

    @property
    def start(self) -> FloatArray:
        """Where the palm is first, transform_palm_to_world, shape (4, 4)."""
        pose: FloatArray = next(iter(self.poses.values()))[0][0]
        return pose
