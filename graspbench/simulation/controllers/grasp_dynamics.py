"""Dynamics of hand, contacts and object in the present state, for controllers that need a model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.stage import Stage
from graspbench.simulation.touch import Touch

_TORQUE_WEIGHT = 10.0
"""Of a torque in N m against a force in N where forces are distributed by least squares, 1/m."""
_SINGULAR = 1e-3
_FLAT = 1e-2
"""Singular values of the contacts' Jacobian, over the largest, below which a finger counts as singular."""


@dataclass(frozen=True, eq=False)
class GraspState:
    """Hand, contacts and object at one time; world axes, twists and wrenches about the object's centre.

    Attributes:
        joints: Shape (n_q,), rad.
        velocities: Shape (n_q,), rad/s.
        mass_matrix: Of the fingers, shape (n_q, n_q).
        bias: Torques of gravity, the palm's acceleration and the fingers' speeds, shape (n_q,), N m.
        contact_jacobian: From joint velocities to the tips' velocities at the contacts, relative to the palm,
            shape (3 n_c, n_q).
        grasp_map: From contact forces to the object's wrench, shape (6, 3 n_c).
        palm_velocities: Of the contacts if they were fixed to the palm, at the step's end, shape (3 n_c,).
        pose: transform_object_to_world, its origin at the centre of mass, shape (4, 4).
        twist: [v; omega] of the object, shape (6,).
        inertia: Of the object, shape (6, 6).
        gyroscopic: Wrench that keeps the object's spin, shape (6,).
    """

    joints: FloatArray
    velocities: FloatArray
    mass_matrix: FloatArray
    bias: FloatArray
    contact_jacobian: FloatArray
    grasp_map: FloatArray
    palm_velocities: FloatArray
    pose: FloatArray
    twist: FloatArray
    inertia: FloatArray
    gyroscopic: FloatArray

    def joint_rates(self) -> FloatArray:
        """Return the least joint velocities that give the contacts velocities, shape (n_q, 3 n_c)."""
        return np.asarray(np.linalg.pinv(self.contact_jacobian, rcond=_FLAT), dtype=np.float64)

    def inertia_with_fingers(self) -> FloatArray:
        """Return the inertia that a wrench on the object feels with contacts that stick, shape (6, 6)."""
        lead = self.joint_rates() @ self.grasp_map.T
        total: FloatArray = self.inertia + lead.T @ self.mass_matrix @ lead
        return total

    def least_forces(self, wrench: FloatArray) -> FloatArray:
        """Return the least contact forces that make a wrench on the object, shape (3 n_c,)."""
        scale = np.array([1.0, 1.0, 1.0, _TORQUE_WEIGHT, _TORQUE_WEIGHT, _TORQUE_WEIGHT])
        inverse = np.linalg.pinv(scale[:, None] * self.grasp_map, rcond=_SINGULAR)
        forces: FloatArray = inverse @ (scale * wrench)
        return forces


class GraspDynamics:
    """Evaluates `GraspState` for a hand whose palm moves as it is told.

    Args:
        stage: Hand and object.
        fingers: The fingers that touch.
    """

    def __init__(self, stage: Stage, fingers: Sequence[int]) -> None:
        self._stage, self._fingers = stage, tuple(fingers)
        hand = stage.model
        self._model = hand.model.copy()
        self._data = self._model.createData()
        self._frames = [self._model.getFrameId(hand.tip_links[f]) for f in fingers]
        self._root_to_palm = np.linalg.inv(hand.transform_palm_to_root)
        body = stage.world.object_model
        self._mass_kg = body.mass_kg
        self._inertia: FloatArray = np.asarray(body.inertia, dtype=np.float64)
        self.weight_n = self._mass_kg * stage.world.scene.gravity

    def state(
        self,
        touches: Sequence[Touch],
        palm: FloatArray,
        palm_twist: FloatArray,
        palm_acceleration: FloatArray,
    ) -> GraspState:
        """Evaluate the present state.

        Args:
            touches: Where each finger touches, world frame.
            palm: transform_palm_to_world, shape (4, 4).
            palm_twist: [v; omega] of the palm at its origin at the end of the step, shape (6,).
            palm_acceleration: Of its origin, shape (3,).
        """
        stage = self._stage
        q, velocity = stage.hand.state()
        to_world = palm @ self._root_to_palm
        rotation = to_world[:3, :3]
        gravity = np.array([0.0, 0.0, -stage.world.scene.gravity])
        self._model.gravity.linear = rotation.T @ (gravity - palm_acceleration)
        bias = np.array(pinocchio.nonLinearEffects(self._model, self._data, q, velocity))
        masses = np.array(pinocchio.crba(self._model, self._data, q))
        masses = np.triu(masses) + np.triu(masses, 1).T
        pinocchio.computeJointJacobians(self._model, self._data, q)
        pinocchio.updateFramePlacements(self._model, self._data)
        pose = stage.world.object_pose()
        n = len(self._fingers)
        jacobian, grasp_map = np.empty((3 * n, len(q))), np.zeros((6, 3 * n))
        palm_velocities = np.empty(3 * n)
        for i, (frame, touch) in enumerate(zip(self._frames, touches, strict=True)):
            rows = slice(3 * i, 3 * i + 3)
            own = pinocchio.getFrameJacobian(
                self._model, self._data, frame, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            arm = rotation.T @ (touch.point - to_world[:3, 3]) - self._data.oMf[frame].translation
            jacobian[rows] = rotation @ (own[:3] - cross(arm) @ own[3:])
            grasp_map[:3, rows] = np.eye(3)
            grasp_map[3:, rows] = cross(touch.point - pose[:3, 3])
            palm_velocities[rows] = palm_twist[:3] + np.cross(palm_twist[3:], touch.point - palm[:3, 3])
        linear, angular = pybullet.getBaseVelocity(stage.world.object_id, physicsClientId=stage.world.client)
        twist = np.array([*linear, *angular])
        inertia = np.zeros((6, 6))
        inertia[:3, :3] = self._mass_kg * np.eye(3)
        inertia[3:, 3:] = pose[:3, :3] @ self._inertia @ pose[:3, :3].T
        gyroscopic = np.zeros(6)
        gyroscopic[3:] = np.cross(twist[3:], inertia[3:, 3:] @ twist[3:])
        return GraspState(
            q, velocity, masses, bias, jacobian, grasp_map, palm_velocities, pose, twist, inertia, gyroscopic
        )

    @property
    def gravity_wrench(self) -> FloatArray:
        """The weight as a wrench about the object's centre, world axes, shape (6,)."""
        return np.array([0.0, 0.0, -self.weight_n, 0.0, 0.0, 0.0])


def cross(v: FloatArray) -> FloatArray:
    """Return the matrix of the cross product with a vector, shape (3, 3)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
