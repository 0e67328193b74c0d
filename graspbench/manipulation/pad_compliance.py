"""Soft pads as springs between a finger's last link and its tip frame; the joints make up for them."""

from dataclasses import replace

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.soft_pad import PadParameters
from graspbench.manipulation.compiled.rotations import turn
from graspbench.manipulation.contact_kinematics import ManipulationSystem, State
from graspbench.manipulation.forces import ContactForces, contact_frame
from graspbench.manipulation.held_object import HeldObject, touch


class PadCompliance:
    """Moves the tip frames of a system to where the loaded pads have them.

    The inverse kinematics then closes its loops on the tips as they are, so that the object stays where it
    shall be while the fingers follow into their pads. Between two times at which the forces are known the
    pads give way evenly.

    Args:
        system: Hand and contacts; its tip frames are moved in place.
        pad: The pads.

    Attributes:
        deflections: How far each tip frame is from its unloaded place, in the frame of the finger's last
            joint: translation and rotation vector, shape (n_c, 6), m and rad.
        indentation_max_m: Deepest indentation so far.
    """

    def __init__(self, system: ManipulationSystem, pad: PadParameters) -> None:
        self._arrays, self._pad = system.arrays, pad
        self._translations = system.arrays.tip_translations.copy()
        self._rotations = system.arrays.tip_rotations.copy()
        self.deflections: FloatArray = np.zeros((system.n_contacts, 6))
        self.indentation_max_m = 0.0
        self._before = self._after = self.deflections

    def load(self, state: State, forces: ContactForces) -> None:
        """Take up the forces of a state: from now on `pass_time` goes to what they do to the pads."""
        self._before = self.deflections
        self._after = np.zeros_like(self.deflections)
        for i, normal_n in enumerate(forces.normal_forces):
            if normal_n <= 0.0:
                continue
            normal = contact_frame(state, i)[0]
            found = self._pad.yielding(float(normal_n), float(self._arrays.tip_radii[i]))
            sideways = forces.forces[i] + normal_n * normal
            to_joint = state.joint_rotations[self._arrays.tip_joints[i]].T
            away = found.indentation_m * normal - sideways / found.sideways_n_per_m
            self._after[i, :3] = to_joint @ away
            self._after[i, 3:] = to_joint @ (-forces.torsions[i] / found.turning_nm_rad * normal)
            self.indentation_max_m = max(self.indentation_max_m, found.indentation_m)

    def pass_time(self, share: float) -> None:
        """Move the tip frames a share of the way, 0 to 1, from the forces before to those last known."""
        self.apply((1.0 - share) * self._before + share * self._after)

    def apply(self, deflections: FloatArray) -> None:
        """Move the tip frames so far from their unloaded places; deflections as in the attribute."""
        self.deflections = deflections
        self._arrays.tip_translations[:] = self._translations + deflections[:, :3]
        for i, rotation in enumerate(self._rotations):
            self._arrays.tip_rotations[i] = turn(deflections[i, 3:], 1.0, rotation)

    def settled(self, held: HeldObject, forces: ContactForces) -> HeldObject:
        """Return a motion's start with the pads loaded: the object where it was, the fingers in their pads.

        Raises:
            ManipulationError: A finger cannot follow into its pad.
        """
        self.load(held.system.state(held.joints, held.variables), forces)
        self.pass_time(1.0)
        self._before = self._after
        to_palm = np.eye(4)
        to_palm[:3, :3], to_palm[:3, 3] = held.rotation, held.position
        coordinates = held.variables[:, :2]
        joints = touch(held.system, held.joints, coordinates, to_palm)
        _, variables = held.system.grasped(
            joints, held.position, held.rotation, coordinates=coordinates, align=False
        )
        return replace(held, joints=joints, variables=variables)
