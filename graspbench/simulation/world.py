"""The physical scene: a table top and one object that comes to rest on it."""

import math
import tempfile
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError, SimulationError
from graspbench.quiet import captured_output
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.bullet_exchange import pose_of, quaternion_of, write_obj
from graspbench.simulation.scene import SceneParameters

if TYPE_CHECKING:
    from graspbench.geometry.model import ObjectModel

_TIME_STEP_S = 1.0 / 480.0
_COLLISION_MARGIN_M = 1e-4
_CONTACT_BREAKING_M = 0.02
_REST_STEPS = 120
_REST_DRIFT_M = 5e-5
_REST_TURN = 1e-3
_ROLLING_FRICTION_M = 2e-4
SPINNING_FRICTION_M = 2e-4


class ObjectWorld:
    """A PyBullet world of its own with one object in it, and nothing else; there is no gravity yet.

    Use it as a context manager, or call `close`.

    Args:
        object_model: The object.
        transform_object_to_world: Where it is first, shape (4, 4).

    Attributes:
        client: PyBullet's number of this world; pass it to every call.
        object_id: Body of the object.

    Raises:
        SimulationError: PyBullet cannot build it.
    """

    def __init__(self, object_model: "ObjectModel", transform_object_to_world: FloatArray) -> None:
        self.object_model = object_model
        self._folder = tempfile.TemporaryDirectory(prefix="graspbench-")
        self.client = pybullet.connect(pybullet.DIRECT)
        try:
            if self.client < 0:
                raise SimulationError(
                    "PyBullet opens no further world", remedy="close worlds that are no longer used"
                )
            # Bullet keeps it for all worlds of a process: a world before this one may have changed it.
            pybullet.setPhysicsEngineParameter(
                contactBreakingThreshold=_CONTACT_BREAKING_M, physicsClientId=self.client
            )
            self._transform_inertial_to_object, self._moments = _principal_axes(object_model)
            self._transform_object_to_inertial = np.linalg.inv(self._transform_inertial_to_object)
            with captured_output():
                self._surround()
                self.object_id = self._add_object(transform_object_to_world)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the world and its files; closing twice does no harm."""
        if self.client >= 0:
            pybullet.disconnect(physicsClientId=self.client)
            self.client = -1
        self._folder.cleanup()

    def object_pose(self) -> FloatArray:
        """Return the present transform_object_to_world, shape (4, 4)."""
        position, quaternion = pybullet.getBasePositionAndOrientation(
            self.object_id, physicsClientId=self.client
        )
        pose: FloatArray = pose_of(position, quaternion) @ self._transform_object_to_inertial
        return pose

    def put_object(self, transform_object_to_world: FloatArray) -> None:
        """Put the object somewhere, at rest, shape (4, 4)."""
        pose = transform_object_to_world @ self._transform_inertial_to_object
        pybullet.resetBasePositionAndOrientation(
            self.object_id, pose[:3, 3].tolist(), quaternion_of(pose), physicsClientId=self.client
        )
        pybullet.resetBaseVelocity(self.object_id, [0.0] * 3, [0.0] * 3, physicsClientId=self.client)

    def carry(self, time_s: float) -> None:
        """Let what carries the object go on for the time of the next step; a table at rest does nothing."""

    def _surround(self) -> None:
        """Set up what is there before the object: in a world of the object alone, nothing."""

    def _add_object(self, object_to_world: FloatArray) -> int:
        """Add the object as a compound of its convex parts, with its own mass and inertia."""
        model = self.object_model
        path = Path(self._folder.name) / "collision.obj"
        write_obj(path, [(part.vertices, part.faces) for part in model.collision_parts])
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH, fileName=str(path), physicsClientId=self.client
        )
        if shape < 0:
            raise SimulationError(
                f"PyBullet cannot use the collision parts of '{model.name}'",
                remedy="check that each of them is a convex body",
                object=model.name,
            )
        inertial = self._transform_inertial_to_object
        pose = object_to_world @ inertial
        body: int = pybullet.createMultiBody(
            model.mass_kg,
            shape,
            basePosition=pose[:3, 3].tolist(),
            baseOrientation=quaternion_of(pose),
            baseInertialFramePosition=inertial[:3, 3].tolist(),
            baseInertialFrameOrientation=quaternion_of(inertial),
            physicsClientId=self.client,
        )
        pybullet.resetBasePositionAndOrientation(
            body, pose[:3, 3].tolist(), quaternion_of(pose), physicsClientId=self.client
        )
        pybullet.changeDynamics(
            body,
            -1,
            localInertiaDiagonal=self._moments.tolist(),
            lateralFriction=model.friction,
            rollingFriction=_ROLLING_FRICTION_M,
            spinningFriction=SPINNING_FRICTION_M,
            collisionMargin=_COLLISION_MARGIN_M,
            physicsClientId=self.client,
        )
        return body


class World(ObjectWorld):
    """A PyBullet world of its own with the object at rest on the table top z = 0.

    Use it as a context manager, or call `close`.

    Args:
        object_model: The object.
        scene: How the scene is set up.
        seed: Draws the object's yaw when the scene leaves it open.

    Attributes:
        moves: Whether the table moves.
        time_s: Time since it does.
        table_id: Body of the table top, an infinite plane.
        transform_object_to_world: Pose of the object's own frame at rest, shape (4, 4).

    Raises:
        SimulationError: The object does not come to rest, or PyBullet cannot build it.
    """

    moves = False
    time_s = 0.0

    def __init__(self, object_model: "ObjectModel", scene: SceneParameters, seed: int = 0) -> None:
        if scene.motion != "none" and not self.moves:
            raise ConfigurationError(
                f"scene.motion = {scene.motion} cannot be used here: this looks at an object at rest",
                remedy="leave it out, or use run, sweep or report",
            )
        self.scene = scene
        super().__init__(object_model, _start_pose(object_model, scene, seed))
        try:
            self._settle()
            self.transform_object_to_world = self.object_pose()
        except BaseException:
            self.close()
            raise

    @property
    def to_table(self) -> FloatArray:
        """The transform from the world to the table's frame, shape (4, 4): what is drawn is drawn there."""
        return np.eye(4)

    def _surround(self) -> None:
        pybullet.setGravity(0, 0, -self.scene.gravity, physicsClientId=self.client)
        pybullet.setTimeStep(_TIME_STEP_S, physicsClientId=self.client)
        self.table_id = self._add_table()

    def _add_table(self) -> int:
        plane = pybullet.createCollisionShape(
            pybullet.GEOM_PLANE, planeNormal=[0, 0, 1], physicsClientId=self.client
        )
        table: int = pybullet.createMultiBody(0.0, plane, physicsClientId=self.client)
        pybullet.changeDynamics(
            table,
            -1,
            lateralFriction=self.scene.table_friction,
            rollingFriction=_ROLLING_FRICTION_M,
            spinningFriction=SPINNING_FRICTION_M,
            physicsClientId=self.client,
        )
        return table

    def _settle(self) -> None:
        """Step until the object has kept its place for a while (its speed alone may jitter)."""
        steps = math.ceil(self.scene.settle_time_s / _TIME_STEP_S)
        before = self.object_pose()
        for _ in range(max(steps // _REST_STEPS, 1)):
            for _ in range(_REST_STEPS):
                pybullet.stepSimulation(physicsClientId=self.client)
            now = self.object_pose()
            drift = float(np.linalg.norm(now[:3, 3] - before[:3, 3]))
            turn = float(np.linalg.norm(now[:3, :3] - before[:3, :3]))
            if drift < _REST_DRIFT_M and turn < _REST_TURN:
                return
            before = now
        raise SimulationError(
            f"'{self.object_model.name}' does not come to rest on the table within "
            f"{self.scene.settle_time_s:g} s",
            remedy="raise scene.settle_time_s, or give the object a steadier pose or more friction",
            object=self.object_model.name,
            drift_m=drift,
        )


def _start_pose(model: "ObjectModel", scene: SceneParameters, seed: int) -> FloatArray:
    """Place the object upright, turned by its yaw, its lowest point just above the table."""
    yaw = (
        np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi)
        if scene.yaw_deg is None
        else math.radians(scene.yaw_deg)
    ) + math.radians(model.yaw_deg)
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:3, 3] = scene.x_m, scene.y_m, scene.drop_height_m - float(model.mesh.bounds[0, 2])
    return pose


def _principal_axes(model: "ObjectModel") -> tuple[FloatArray, FloatArray]:
    """Return the pose of the principal axes of inertia in the object frame, and their moments."""
    moments, axes = np.linalg.eigh(model.inertia)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    frame = np.eye(4)
    frame[:3, :3] = axes
    return frame, moments
