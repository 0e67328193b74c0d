"""The physics of a stand: a hand on a floating wrist and one object, stepped under forces; no gravity."""

from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import SimulationError
from graspbench.hand.model import HandModel
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.mounts.floating import FloatingWrist
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.stand_parameters import StandParameters
from graspbench.simulation.tip_friction import TipFriction
from graspbench.simulation.world import ObjectWorld

if TYPE_CHECKING:
    from graspbench.geometry.model import ObjectModel

_CONTACT_BREAKING_M = 0.002
_FAR_M = 100.0


class StandPhysics:
    """A hand and an object that are loaded once, for any number of trials.

    Joints are springs and dampers towards a posture, given to the physics as torques. That is exact, and it
    is stable because every joint carries the inertia of its motor behind the gears, as real ones do: motors
    of the solver would give next to nothing of a spring's torque to a light link that touches.

    Args:
        hand: The hand.
        object_model: The object.
        parameters: The physics.

    Attributes:
        fingers: The hand in the physics.
        friction: Coulomb friction between hand and object.
        mass_kg: The object's mass.

    Raises:
        HandError: PyBullet cannot load the hand.
        SimulationError: PyBullet cannot build the object.
    """

    def __init__(self, hand: HandModel, object_model: "ObjectModel", parameters: StandParameters) -> None:
        self._hand, self._object_model, self._parameters = hand, object_model, parameters
        self.friction, self.mass_kg = object_model.friction, object_model.mass_kg
        far = np.eye(4)
        far[2, 3] = _FAR_M
        self._world = ObjectWorld(object_model, far)
        self._saved = -1
        try:
            self._client = self._world.client
            pybullet.setPhysicsEngineParameter(
                contactBreakingThreshold=_CONTACT_BREAKING_M,
                fixedTimeStep=parameters.time_step_s,
                numSolverIterations=parameters.solver_iterations,
                physicsClientId=self._client,
            )
            self._wrist = FloatingWrist(hand, np.eye(4), np.array([0.0, 0.0, 1.0]))
            friction = TipFriction(self.friction, parameters.torsional_friction_m, self.friction)
            self.fingers = SimulatedHand(self._world, hand, self._wrist, hand.rest, friction)
            self.fingers.drive_by_torques(parameters.rotor_inertia_kg_m2)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Free the world; closing twice does no harm."""
        self._world.close()

    def set_object(self, mass_kg: float, friction: float) -> None:
        """Give the object a mass and its contacts a friction."""
        self.mass_kg, self.friction = mass_kg, friction
        share = mass_kg / self._object_model.mass_kg
        moments = np.linalg.eigvalsh(self._object_model.inertia) * share
        pybullet.changeDynamics(
            self._world.object_id,
            -1,
            mass=mass_kg,
            localInertiaDiagonal=moments.tolist(),
            lateralFriction=1.0,
            rollingFriction=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            physicsClientId=self._client,
        )
        # Bullet multiplies the two bodies' coefficients.
        for link in range(-1, pybullet.getNumJoints(self.fingers.body, physicsClientId=self._client)):
            pybullet.changeDynamics(
                self.fingers.body, link, lateralFriction=friction, physicsClientId=self._client
            )

    def put(self, palm: FloatArray, joints: FloatArray, object_pose: FloatArray) -> None:
        """Put hand and object somewhere at once, at rest; poses in the stand, shape (4, 4)."""
        self._world.put_object(object_pose)
        self._wrist.put(palm)
        self.fingers.put(joints)

    def save(self) -> None:
        """Remember the state; the one that was remembered before is forgotten."""
        if self._saved >= 0:
            pybullet.removeState(self._saved, physicsClientId=self._client)
        self._saved = pybullet.saveState(physicsClientId=self._client)

    def restore(self, palm: FloatArray) -> None:
        """Return to the remembered state, in which the palm was wanted at a pose, shape (4, 4)."""
        self._wrist.put(palm)  # so that its motors have no goal of a trial before
        pybullet.restoreState(stateId=self._saved, physicsClientId=self._client)

    def step(
        self,
        palm: FloatArray,
        joints: FloatArray,
        force_n: FloatArray | None = None,
        torque_nm: FloatArray | None = None,
    ) -> None:
        """Advance time by a step.

        Args:
            palm: Where the palm is wanted at its end, shape (4, 4).
            joints: Where the joints' springs pull to, shape (n_q,).
            force_n: On the object's centre, stand frame, shape (3,).
            torque_nm: On the object, shape (3,).
        """
        p = self._parameters
        self.fingers.drive_wrist(palm, p.time_step_s)
        q, velocity = self.fingers.state()
        self.fingers.apply_torques(p.stiffness_nm_rad * (joints - q) - p.damping_nms_rad * velocity)
        body, client = self._world.object_id, self._client
        if force_n is not None and np.any(force_n):
            at, _ = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
            pybullet.applyExternalForce(
                body, -1, force_n.tolist(), at, pybullet.WORLD_FRAME, physicsClientId=client
            )
        if torque_nm is not None and np.any(torque_nm):
            pybullet.applyExternalTorque(
                body, -1, torque_nm.tolist(), pybullet.WORLD_FRAME, physicsClientId=client
            )
        pybullet.stepSimulation(physicsClientId=client)

    def object_pose(self) -> FloatArray:
        """Return the object's pose in the stand, shape (4, 4)."""
        pose = self._world.object_pose()
        if not np.isfinite(pose).all():
            raise SimulationError("the object's pose is not finite", remedy="reduce stand.time_step_s")
        return pose

    def object_in_palm(self) -> FloatArray:
        """Return transform_object_to_palm, shape (4, 4)."""
        pose: FloatArray = np.linalg.inv(self.fingers.palm_pose()) @ self.object_pose()
        return pose
