"""A physical scene whose table moves with the object on it: a conveyor, a turntable, a drift."""

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import SimulationError
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.bullet_exchange import pose_of
from graspbench.simulation.scene import SceneParameters
from graspbench.simulation.world import SPINNING_FRICTION_M, World

if TYPE_CHECKING:
    from graspbench.geometry.model import ObjectModel

_TIME_STEP_S = 1.0 / 480.0
_ROLLING_FRICTION_M = 2e-4
_HALF_LENGTH_M = 4.0
_HALF_THICKNESS_M = 0.05
_MASS_KG = 100.0
_LIGHT_KG, _LIGHT_KGM2 = 1.0, 0.01
_FORCE = 1e6
_START_S = 1.5
"""In which the belt comes up to its speed; what stands on it is not to topple."""

_FALLEN = 0.5
"""Cosine of the tilt at which an object on the belt has fallen over."""

_SPEEDS_M_S = {"conveyor": 0.1, "drift": 0.03, "turntable": 0.0, "none": 0.0}
_TURN_RATES_DEG_S = {"conveyor": 0.0, "drift": 8.0, "turntable": 30.0, "none": 0.0}


class Pace(NamedTuple):
    """How fast the belt goes.

    Attributes:
        velocity_m_s: Along its own x and y, which are the world's at first, shape (2,).
        yaw_rate_rad_s: About its vertical axis.
    """

    velocity_m_s: FloatArray
    yaw_rate_rad_s: float


class MovingWorld(World):
    """A world whose table top is a slab that is really driven: two sliding joints and a turning one.

    The object is carried by friction alone, so it may slip, roll or sway as it would on a belt. The slab is
    one rigid piece, which is what a belt is between its rollers. It is started slowly and does not stop when
    the object is grasped.

    Args:
        object_model: The object.
        scene: How the scene is set up; ``motion`` is not "none".
        seed: Draws the object's yaw when the scene leaves it open.
        lead_s: The object passes ``scene.x_m``, ``scene.y_m`` so long after the first image.

    Attributes:
        time_s: Time since the belt has its speed.
        entry: About where the object is then, world x, y, and 0, shape (3,): where the belt is known to
            bring objects from, not the object's own place.

    Raises:
        SimulationError: The object does not come to rest, falls over, or PyBullet cannot build the world.
    """

    moves = True

    def __init__(
        self, object_model: "ObjectModel", scene: SceneParameters, seed: int = 0, lead_s: float = 0.0
    ) -> None:
        self._travel, self._kind = scene.travel, scene.motion
        self.time_s = -_START_S
        self._axis = np.array([scene.x_m, scene.y_m])
        back = np.zeros(2)
        if scene.motion == "turntable":
            self._axis = self._axis - [scene.travel.axis_distance_m, 0.0]
        else:
            back = (lead_s + 0.5 * _START_S) * self.pace(0.0).velocity_m_s
        self.entry = np.append(-lead_s * self.pace(0.0).velocity_m_s, 0.0)
        self._mark = np.eye(4)
        self._mark[:2, 3] = [scene.x_m, scene.y_m] - back - self._axis
        self._turned = 0.0
        self._driven: tuple[float, ...] = ()
        start = replace(scene, x_m=scene.x_m - float(back[0]), y_m=scene.y_m - float(back[1]))
        super().__init__(object_model, start, seed)
        self.scene = scene
        try:
            upright = self.object_pose()[:3, 2]
            self.advance(_START_S)
            if upright @ self.object_pose()[:3, 2] < _FALLEN:
                raise SimulationError(
                    f"'{object_model.name}' falls over when the {scene.motion} starts",
                    remedy="lower scene.travel.speed_m_s, or give the object a steadier pose",
                    object=object_model.name,
                )
            self.transform_object_to_world = self.object_pose()
        except BaseException:
            self.close()
            raise

    def pace(self, time_s: float) -> Pace:
        """Return how fast the belt goes at a time."""
        p, kind = self._travel, self._kind
        speed = _SPEEDS_M_S[kind] if p.speed_m_s is None else p.speed_m_s
        rate = np.radians(_TURN_RATES_DEG_S[kind] if p.turn_rate_deg_s is None else p.turn_rate_deg_s)
        speed, rate = 0.0 if kind == "turntable" else speed, 0.0 if kind == "conveyor" else float(rate)
        swing = 1.0 + p.variation * np.sin(2.0 * np.pi * time_s / p.period_s) if kind == "drift" else 1.0
        start = min(max(1.0 + time_s / _START_S, 0.0), 1.0)
        way = np.radians(p.direction_deg)
        velocity: FloatArray = float(start * swing * speed) * np.array([np.cos(way), np.sin(way)])
        return Pace(velocity, float(start * swing * rate))

    def carry(self, time_s: float) -> None:
        """Drive the belt at its pace for the time of the next step."""
        pace = self.pace(self.time_s + 0.5 * time_s)
        self.time_s += time_s
        # The belt's twist is given in its own axes: a drift that turns goes round.
        self._turned += 0.5 * time_s * pace.yaw_rate_rad_s
        along = complex(*pace.velocity_m_s.tolist()) * complex(np.cos(self._turned), np.sin(self._turned))
        self._turned += 0.5 * time_s * pace.yaw_rate_rad_s
        speeds = (along.real, along.imag, pace.yaw_rate_rad_s)
        if speeds != self._driven:
            self._driven = speeds
            self._drive(speeds)

    def advance(self, time_s: float) -> None:
        """Let time go by."""
        steps = max(1, round(time_s / _TIME_STEP_S))
        pybullet.setTimeStep(_TIME_STEP_S, physicsClientId=self.client)
        for _ in range(steps):
            self.carry(time_s / steps)
            pybullet.stepSimulation(physicsClientId=self.client)

    @property
    def to_table(self) -> FloatArray:
        """The transform from the world to a frame that the belt carries along, shape (4, 4).

        Its plane z = 0 is the belt's top; its origin was below the object's place when the belt stood still.
        """
        state = pybullet.getLinkState(
            self.table_id, 2, computeForwardKinematics=True, physicsClientId=self.client
        )
        return np.asarray(np.linalg.inv(pose_of(state[4], state[5]) @ self._mark), dtype=np.float64)

    def _drive(self, speeds: tuple[float, ...]) -> None:
        pybullet.setJointMotorControlArray(
            self.table_id,
            [0, 1, 2],
            pybullet.VELOCITY_CONTROL,
            targetVelocities=speeds,
            forces=[_FORCE] * 3,
            physicsClientId=self.client,
        )

    def _add_table(self) -> int:
        slab = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=[_HALF_LENGTH_M, _HALF_LENGTH_M, _HALF_THICKNESS_M],
            collisionFramePosition=[0.0, 0.0, -_HALF_THICKNESS_M],
            physicsClientId=self.client,
        )
        none, identity = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]
        table: int = pybullet.createMultiBody(
            0.0,
            basePosition=[*self._axis.tolist(), 0.0],
            linkMasses=[_LIGHT_KG, _LIGHT_KG, _MASS_KG],
            linkCollisionShapeIndices=[-1, -1, slab],
            linkVisualShapeIndices=[-1] * 3,
            linkPositions=[none] * 3,
            linkOrientations=[identity] * 3,
            linkInertialFramePositions=[none] * 3,
            linkInertialFrameOrientations=[identity] * 3,
            linkParentIndices=[0, 1, 2],
            linkJointTypes=[pybullet.JOINT_PRISMATIC, pybullet.JOINT_PRISMATIC, pybullet.JOINT_REVOLUTE],
            linkJointAxis=[[1, 0, 0], [0, 1, 0], [0, 0, 1]],
            physicsClientId=self.client,
        )
        for link in (0, 1):
            pybullet.changeDynamics(
                table, link, localInertiaDiagonal=[_LIGHT_KGM2] * 3, physicsClientId=self.client
            )
        for link in range(3):
            pybullet.changeDynamics(
                table, link, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0,
                physicsClientId=self.client,
            )  # fmt: skip
        pybullet.changeDynamics(
            table,
            2,
            lateralFriction=self.scene.table_friction,
            rollingFriction=_ROLLING_FRICTION_M,
            spinningFriction=SPINNING_FRICTION_M,
            physicsClientId=self.client,
        )
        self.table_id = table
        self._drive((0.0, 0.0, 0.0))
        return table
