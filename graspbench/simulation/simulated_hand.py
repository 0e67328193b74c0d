"""The hand in the physics simulation: driven by positions, then by torques; felt by its contacts."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import HandError
from graspbench.hand.model import HandModel
from graspbench.quiet import captured_output
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.bullet_exchange import pose_of, quaternion_of
from graspbench.simulation.hand_links import couple, fingers_of_links
from graspbench.simulation.mounts.motors import POSITION_GAIN
from graspbench.simulation.mounts.mount import Mount
from graspbench.simulation.tip_friction import TipFriction
from graspbench.simulation.touch import Touch, touch_of
from graspbench.simulation.world import SPINNING_FRICTION_M, ObjectWorld

_JOINT_SPEED = 1e6
"""Bullet cuts joint speeds at 100 rad/s before it solves contacts and gears. A torque gives a joint of a few
grams more than that within a step, and what is cut is missing in the balance of forces: fingers pressed
unevenly, and lost what they hold with a step of a quarter; where joints follow others, they pressed
three times too hard."""

_TIP_MARGIN_M = 1e-5


class SimulatedHand:
    """A hand on its mount in a world.

    Args:
        world: The world, with the object at rest.
        hand: The hand model.
        mount: What carries the hand; it is where the hand appears first.
        joints: The fingers' first joint positions, shape (n_q,).
        friction: Between fingertips and object.

    Attributes:
        palm_goal: Where the palm was last wanted, transform_palm_to_world, shape (4, 4).

    Raises:
        HandError: PyBullet cannot load the hand, or lacks one of its joints.
    """

    def __init__(
        self, world: ObjectWorld, hand: HandModel, mount: Mount, joints: FloatArray, friction: TipFriction
    ) -> None:
        self.world = world
        self.hand = hand
        self.mount = mount
        self._client = world.client
        self.body = self._load()
        ids, links = self._names()
        self._ids = ids
        self._joint_ids = self._find(hand.joint_names, ids)
        self._tip_ids = [links[name] for name in hand.tip_links]
        self._finger_of_link = fingers_of_links(self._client, self.body, hand, links, ids)
        self._set_friction(friction)
        self._sharpen_tips()
        self._lift_limits()
        mount.attach(self._client, self.body, ids)
        for i, value in zip(self._joint_ids, joints, strict=True):
            pybullet.resetJointState(self.body, i, value, 0.0, physicsClientId=self._client)
        couple(self._client, self.body, hand, ids, joints)
        self.palm_goal = mount.palm_pose()
        self.drive_joints(joints, np.zeros(len(joints)))

    def drive_wrist(self, transform_palm_to_world: FloatArray, time_step_s: float) -> None:
        """Set the palm's goal for the end of the next step, shape (4, 4)."""
        self.palm_goal = transform_palm_to_world
        self.mount.drive(transform_palm_to_world, time_step_s)

    def put(self, joints: FloatArray) -> None:
        """Put the fingers somewhere at once, at rest, shape (n_q,), and the joints that follow them."""
        at = dict(zip(self.hand.joint_names, joints, strict=True))
        for i, value in zip(self._joint_ids, joints, strict=True):
            pybullet.resetJointState(self.body, i, value, 0.0, physicsClientId=self._client)
        for follower in self.hand.followers:
            position = follower.ratio * at[follower.leader] + follower.offset
            own = self._ids[follower.name]
            pybullet.resetJointState(self.body, own, position, 0.0, physicsClientId=self._client)

    def palm_pose(self) -> FloatArray:
        """Return the palm's real transform_palm_to_world, shape (4, 4)."""
        return self.mount.palm_pose()

    def drive_joints(self, positions: FloatArray, velocities: FloatArray) -> None:
        """Drive the fingers to positions, shape (n_q,), within their torque limits."""
        n = len(self._joint_ids)
        pybullet.setJointMotorControlArray(
            self.body,
            self._joint_ids,
            pybullet.POSITION_CONTROL,
            targetPositions=positions.tolist(),
            targetVelocities=velocities.tolist(),
            forces=self.hand.effort_limits.tolist(),
            positionGains=[POSITION_GAIN] * n,
            velocityGains=[1.0] * n,
            physicsClientId=self._client,
        )

    def drive_compliantly(
        self, torques: FloatArray, springs: FloatArray, velocities: FloatArray, joints: IntArray
    ) -> None:
        """Apply torques, and springs and dampers that no time step makes unstable, for the next step.

        Joints that are not named stay with the motors that held them: a light finger that touches nothing
        is not stable under torques alone.

        The springs are servos for the velocity at which spring and damper balance, limited to the torque of
        both. They give exactly this torque to a joint that is held, and cannot overshoot in a joint that is
        free, however light its link is.

        Args:
            torques: Applied in any case, shape (n_q,), N m.
            springs: Torques of springs and dampers in the present state, shape (n_q,), N m.
            velocities: At which they would vanish, shape (n_q,), rad/s.
            joints: The joints to drive, shape (k,).
        """
        limits = self.hand.effort_limits[joints]
        applied = np.minimum(np.maximum(torques[joints], -limits), limits)
        left = np.minimum(np.abs(springs[joints]), limits - np.abs(applied))
        ids = [self._joint_ids[i] for i in joints]
        pybullet.setJointMotorControlArray(
            self.body,
            ids,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=velocities[joints].tolist(),
            forces=left.tolist(),
            physicsClientId=self._client,
        )
        pybullet.setJointMotorControlArray(
            self.body,
            ids,
            pybullet.TORQUE_CONTROL,
            forces=applied.tolist(),
            physicsClientId=self._client,
        )

    def drive_by_torques(self, rotor_inertia_kg_m2: float) -> None:
        """Switch the fingers' motors off, for `apply_torques`, and give every joint its motor's inertia.

        Args:
            rotor_inertia_kg_m2: Inertia of a joint's motor, as it is felt behind the gears.
        """
        pybullet.setJointMotorControlArray(
            self.body,
            self._joint_ids,
            pybullet.VELOCITY_CONTROL,
            forces=[0.0] * len(self._joint_ids),
            physicsClientId=self._client,
        )
        for link in self._joint_ids:
            moments = pybullet.getDynamicsInfo(self.body, link, physicsClientId=self._client)[2]
            pybullet.changeDynamics(
                self.body,
                link,
                localInertiaDiagonal=[moment + rotor_inertia_kg_m2 for moment in moments],
                physicsClientId=self._client,
            )

    def apply_torques(self, torques: FloatArray) -> None:
        """Apply torques within the joints' limits for the next step, shape (n_q,), N m."""
        limits = self.hand.effort_limits
        pybullet.setJointMotorControlArray(
            self.body,
            self._joint_ids,
            pybullet.TORQUE_CONTROL,
            forces=np.minimum(np.maximum(torques, -limits), limits).tolist(),
            physicsClientId=self._client,
        )

    def touching(self, least_force_n: float) -> int:
        """Return how many fingers touch the object with at least a normal force, as `touches` finds them."""
        found = pybullet.getContactPoints(self.world.object_id, self.body, physicsClientId=self._client)
        tips, others = [0.0] * self.hand.n_fingers, [0.0] * self.hand.n_fingers
        for contact in found:
            owner = self._finger_of_link.get(contact[4])
            if owner is not None and contact[9] > 0.0:
                (tips if owner[1] else others)[owner[0]] += contact[9]
        return sum((tip or other) >= least_force_n for tip, other in zip(tips, others, strict=True))

    def state(self) -> tuple[FloatArray, FloatArray]:
        """Return joint positions and velocities, each shape (n_q,)."""
        states = pybullet.getJointStates(self.body, self._joint_ids, physicsClientId=self._client)
        return np.array([s[0] for s in states]), np.array([s[1] for s in states])

    def is_near_object(self, distance_m: float) -> bool:
        """Return whether any link is closer to the object than a distance."""
        near = pybullet.getClosestPoints(
            self.body, self.world.object_id, distance_m, physicsClientId=self._client
        )
        return bool(near)

    def tip_poses(self, fingers: Sequence[int]) -> FloatArray:
        """Return the poses of fingers' tip links in the world, shape (n, 4, 4)."""
        states = pybullet.getLinkStates(
            self.body,
            [self._tip_ids[f] for f in fingers],
            computeForwardKinematics=True,
            physicsClientId=self._client,
        )
        return np.stack([pose_of(state[4], state[5]) for state in states])

    def touches(self, least_force_n: float) -> tuple[Touch | None, ...]:
        """Return every finger's contact with the object, None where the force is too small."""
        found = pybullet.getContactPoints(self.world.object_id, self.body, physicsClientId=self._client)
        sums: list[list[tuple[float, tuple[float, ...], tuple[float, ...], bool]]] = [
            [] for _ in self.hand.finger_names
        ]
        for contact in found:
            owner = self._finger_of_link.get(contact[4])
            if owner is not None and contact[9] > 0.0:
                sums[owner[0]].append((contact[9], contact[6], contact[7], owner[1]))
        return tuple(touch_of(parts, least_force_n) for parts in sums)

    def force_on_object(self, about: FloatArray) -> FloatArray:
        """Return the wrench of all contacts with the hand in the step before, shape (6,), N and N m.

        Torques that contacts bear about their normals are not in it: Bullet does not tell them.

        Args:
            about: Point in the world that torques are about, shape (3,).
        """
        wrench = np.zeros(6)
        for contact in pybullet.getContactPoints(
            self.world.object_id, self.body, physicsClientId=self._client
        ):
            force = contact[9] * np.array(contact[7])
            force += contact[10] * np.array(contact[11]) + contact[12] * np.array(contact[13])
            wrench[:3] += force
            wrench[3:] += np.cross(np.array(contact[6]) - about, force)
        return wrench

    def _load(self) -> int:
        base = self.mount.base_to_world
        with tempfile.TemporaryDirectory(prefix="graspbench-") as folder:
            path = Path(folder) / "hand.urdf"
            path.write_text(self.mount.urdf(), encoding="utf-8")
            try:
                with captured_output():
                    body: int = pybullet.loadURDF(
                        str(path),
                        basePosition=base[:3, 3].tolist(),
                        baseOrientation=quaternion_of(base),
                        useFixedBase=True,
                        flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
                        physicsClientId=self._client,
                    )
            except pybullet.error as error:
                raise HandError(
                    f"PyBullet cannot load the hand '{self.hand.name}' from '{self.hand.urdf_path}'",
                    remedy="save its collision meshes as STL, OBJ or DAE, and check its tree of links",
                ) from error
        return body

    def _names(self) -> tuple[dict[str, int], dict[str, int]]:
        joints, links = {}, {}
        for i in range(pybullet.getNumJoints(self.body, physicsClientId=self._client)):
            info = pybullet.getJointInfo(self.body, i, physicsClientId=self._client)
            joints[info[1].decode()] = i
            links[info[12].decode()] = i
        return joints, links

    def _find(self, names: tuple[str, ...], ids: dict[str, int]) -> list[int]:
        missing = [name for name in names if name not in ids]
        if missing:
            raise HandError(f"PyBullet's hand '{self.hand.name}' has no joint '{missing[0]}'")
        return [ids[name] for name in names]

    def set_torsion(self, finger: int, torsional_m: float) -> None:
        """Set the torque about the contact normal per normal force of one finger, m."""
        spinning = spinning_friction(torsional_m, self._lateral, self.world.object_model.friction)
        for link, (owner, _) in self._finger_of_link.items():
            if owner == finger:
                pybullet.changeDynamics(
                    self.body, link, spinningFriction=spinning, physicsClientId=self._client
                )

    def _set_friction(self, friction: TipFriction) -> None:
        # Bullet multiplies the two bodies' coefficients.
        self._lateral = friction.coulomb / max(self.world.object_model.friction, 1e-6)
        spinning = spinning_friction(friction.torsional_m, self._lateral, self.world.object_model.friction)
        for link in self._finger_of_link:
            pybullet.changeDynamics(
                self.body,
                link,
                lateralFriction=self._lateral,
                spinningFriction=spinning,
                rollingFriction=0.0,
                restitution=0.0,
                physicsClientId=self._client,
            )

    def _sharpen_tips(self) -> None:
        """Let links that touch as they are have their own size and edges.

        Bullet adds a margin of 1 mm around meshes and cylinders, and rounds boxes by as much.
        """
        if not self.hand.tips_are_links:
            return
        for link in self._finger_of_link:
            pybullet.changeDynamics(
                self.body, link, collisionMargin=_TIP_MARGIN_M, physicsClientId=self._client
            )

    def _lift_limits(self) -> None:
        """Free all joints, also of fingers that take no part, of what the physics does to them by itself.

        What a description states as damping is applied from one step to the next, which no light link stands.
        """
        # Two calls: told both at once, pybullet forgets the damping.
        for link in range(pybullet.getNumJoints(self.body, physicsClientId=self._client)):
            pybullet.changeDynamics(self.body, link, jointDamping=0.0, physicsClientId=self._client)
        pybullet.changeDynamics(self.body, 0, maxJointVelocity=_JOINT_SPEED, physicsClientId=self._client)


def spinning_friction(torsional_m: float, own_lateral: float, object_lateral: float) -> float:
    """Return a fingertip's spinning friction that makes a torque about the normal per normal force.

    Bullet adds up each body's spinning friction times the other's lateral friction. The object's own, which
    keeps it from spinning on the table for ever, bounds the torque from below.

    Args:
        torsional_m: Torque per normal force between fingertip and object, m.
        own_lateral: Lateral friction of the fingertip in Bullet.
        object_lateral: That of the object.
    """
    left = torsional_m - SPINNING_FRICTION_M * own_lateral
    return max(left, 0.0) / max(object_lateral, 1e-6)
