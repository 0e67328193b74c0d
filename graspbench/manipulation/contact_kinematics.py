"""Contacts of fingers with an object: their types and the extended fingers they make (thesis 4.2)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError, ManipulationError
from graspbench.manipulation.charts import Chart
from graspbench.manipulation.compiled.control_step import update_state
from graspbench.manipulation.compiled.finger_groups import finger_groups, joint_turns
from graspbench.manipulation.compiled.rotations import EULER_GUARD, euler_angles
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays
from graspbench.manipulation.kinematic_tree import KinematicTree

ContactType: TypeAlias = Literal["frictionless", "hard", "soft", "soft_pad", "rolling"]

WITH_TORSION: tuple[ContactType, ...] = ("soft", "soft_pad")
"""Contacts that resist turning about their normal."""

_FREE: dict[str, tuple[bool, ...]] = {  # which of (u, v, theta_1, theta_2, theta_3) may vary
    "frictionless": (True, True, True, True, True),
    "hard": (False, False, True, True, True),
    "soft": (False, False, True, True, False),
    "soft_pad": (False, False, True, True, False),
    "rolling": (False, False, True, True, True),
}


@dataclass(frozen=True, eq=False)
class Contact:
    """One fingertip on the object.

    Attributes:
        chart: Chart of the object's surface around the contact.
        kind: "frictionless" (slides and turns), "hard" (turns), "soft" and "soft_pad" (turn except about
            the normal), or "rolling" (a spherical tip that rolls without slip; the contact moves).
        tip_radius_m: Radius of the spherical tip around the finger frame's origin, 0 for a sharp tip.
        slides: Whether it slides and turns all the same, with the friction of its kind.
        led: Whether it slides on a given way, so that its coordinates are no variables.
    """

    chart: Chart
    kind: ContactType
    tip_radius_m: float = 0.0
    slides: bool = False
    led: bool = False


class ManipulationSystem:
    """A hand, its contacts and the object, as one stacked system of extended fingers (4.9).

    The variables are z = [q; eta]: all joints, then the free contact variables finger by finger. Joints
    that fingers share appear once, so fingers of their own and fingers of one arm are the same case.

    Args:
        tree: The hand; finger i of the system is its tip i.
        contacts: One contact a tip.
        planar: Only x, y and omega_z count: of the contact variables remain v and theta_1.

    Raises:
        ConfigurationError: Contacts and tips do not match, or a rolling contact has a sharp tip.

    Attributes:
        tree: The hand.
        contacts: The contacts.
        n_joints: n_q.
        n_variables: Length of z.
        rows: Components of a twist that count, 3 or 6.
        planar: As given.
        arrays: What compiled code reads.
        sizes: The named sizes of a state's arrays.
    """

    def __init__(self, tree: KinematicTree, contacts: Sequence[Contact], *, planar: bool = False) -> None:
        if len(contacts) != tree.n_tips:
            raise ConfigurationError(f"{tree.n_tips} fingertips but {len(contacts)} contacts")
        for contact in contacts:
            if contact.kind not in _FREE:
                raise ConfigurationError(
                    f"unknown contact type '{contact.kind}'", remedy=f"choose one of {', '.join(_FREE)}"
                )
            if contact.kind == "rolling" and contact.tip_radius_m <= 0.0:
                raise ConfigurationError("a sharp tip cannot roll", remedy="give a tip radius or type hard")
        self.tree = tree
        self.contacts = tuple(contacts)
        self.planar = planar
        self.n_joints = tree.n_joints
        self.n_contacts = len(contacts)
        xi, theta, self.n_variables = _columns(contacts, tree.n_joints, planar)
        components = np.array([0, 1, 5] if planar else range(6), dtype=np.int64)
        self.rows = len(components)
        chart_numbers = np.zeros((self.n_contacts, max(c.chart.numbers.size for c in contacts)))
        for i, contact in enumerate(contacts):
            chart_numbers[i, : contact.chart.numbers.size] = contact.chart.numbers
        self.arrays = SystemArrays(
            joint_turns=joint_turns(tree),
            placement_translations=tree.placement_translations,
            axes=tree.axes,
            tip_rotations=tree.tip_rotations,
            tip_translations=tree.tip_translations,
            tip_radii=[c.tip_radius_m for c in contacts],
            chart_rotations=[c.chart.rotation for c in contacts],
            chart_origins=[c.chart.origin for c in contacts],
            chart_numbers=chart_numbers,
            parents=tree.parents,
            tip_joints=tree.tip_joints,
            paths=tree.paths(),
            chart_kinds=[c.chart.kind for c in contacts],
            rolling=[c.kind == "rolling" and not c.slides for c in contacts],
            xi_columns=xi,
            theta_columns=theta,
            twist_components=components,
            **finger_groups(tree.paths(), xi, theta, self.rows, self.n_variables)._asdict(),
        )
        self.sizes = {
            "joints": self.n_joints,
            "contacts": self.n_contacts,
            "variables": self.n_variables,
            "stacked_rows": self.rows * self.n_contacts,
        }

    @property
    def xi_columns(self) -> IntArray:
        """Variable of each contact coordinate, -1 where it is constant, shape (n_c, 2)."""
        return self.arrays.xi_columns

    @property
    def theta_columns(self) -> IntArray:
        """Variable of each ball joint angle, -1 where it is constant, shape (n_c, 3)."""
        return self.arrays.theta_columns

    def state(self, joints: FloatArray, contact_variables: FloatArray) -> "State":
        """Return the evaluated state at joints, shape (n_q,), and [xi; theta], shape (n_c, 5)."""
        state = State(self)
        state.update(joints, contact_variables)
        return state

    def grasped(
        self,
        joints: FloatArray,
        position: FloatArray,
        rotation: FloatArray,
        *,
        coordinates: FloatArray | None = None,
        align: bool = True,
    ) -> tuple["ManipulationSystem", FloatArray]:
        """Return a system and the contact variables at which the hand holds an object of this pose.

        Args:
            joints: Joint positions, shape (n_q,).
            position: Object's origin in the base frame, shape (3,).
            rotation: Object's orientation, shape (3, 3).
            coordinates: Where the tips touch, chart coordinates, shape (n_c, 2); by default at the point
                nearest to each tip.
            align: Turn the finger frames to the contact frames, so that the Euler angles start at
                0, far from their singularity; a finger frame may be any frame fixed to the tip.

        Returns:
            The system (with its finger frames turned if ``align``) and [xi; theta], shape (n_c, 5).

        Raises:
            ManipulationError: A tip is off its chart, or an angle is at the singularity.
        """
        probe = self.state(joints, np.zeros((self.n_contacts, 5)))
        variables = np.zeros((self.n_contacts, 5))
        rotations = self.tree.tip_rotations.copy()
        for i, contact in enumerate(self.contacts):
            if coordinates is None:
                tip = rotation.T @ (probe.tip_positions[i] - position)
                # The nearest point of the surface to the tip's centre is the contact.
                xi = contact.chart.locate(tip, tolerance_m=contact.tip_radius_m + 5e-3)
            else:
                xi = coordinates[i]
            variables[i, :2] = xi
            relative = probe.tip_rotations[i].T @ rotation @ contact.chart(xi).frame
            if align:
                rotations[i] = rotations[i] @ relative
            else:
                variables[i, 2:] = euler_angles(relative)
        if not align:
            return self, variables
        tree = replace(self.tree, tip_rotations=rotations)
        return ManipulationSystem(tree, self.contacts, planar=self.planar), variables


class State(StateArrays):
    """The system at one configuration; updated in place, because a control loop asks for many.

    The attributes are those of `StateArrays`, and:

    Attributes:
        system: The system.
    """

    def __init__(self, system: ManipulationSystem) -> None:
        self.system = system
        super().__init__(sizes=system.sizes)

    def update(self, joints: FloatArray, contact_variables: FloatArray) -> None:
        """Move to a configuration.

        Raises:
            ManipulationError: An Euler angle is at its singularity.
        """
        self.joints[:] = joints
        self.contact_variables[:] = contact_variables
        if update_state(self.system.arrays.block, self.block) < EULER_GUARD:
            self.refuse_singularity()

    def refuse_singularity(self) -> None:
        """Say which contact's Euler angles are at their singularity.

        Raises:
            ManipulationError: Always.
        """
        contact = int(np.argmin(np.cos(self.contact_variables[:, 3])))
        raise ManipulationError(
            f"the ball joint angles of contact {contact} reached their singularity at 90 deg",
            remedy="start with aligned finger frames, or turn the object less",
            contact=contact,
        )

    def grasp_transpose(self, contact: int) -> FloatArray:
        """Return G_i^T of (4.5), its counting rows and columns, shape (rows, rows)."""
        x, y, z = self.levers[contact]
        full = np.eye(6)
        full[:3, 3:] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        keep = self.system.arrays.twist_components
        return full[np.ix_(keep, keep)]

    def rates(self, velocity: FloatArray) -> FloatArray:
        """Return the rates of all contact variables, shape (n_c, 5), for z', shape (n,)."""
        out = np.zeros((self.system.n_contacts, 5))
        out[:, :2] = self.xi_jacobians @ velocity
        columns = self.system.arrays.theta_columns
        out[:, 2:] = np.where(columns >= 0, velocity[columns], 0.0)
        return out


def contact_columns(system: ManipulationSystem, contact: int) -> IntArray:
    """Return the variables that belong to one contact."""
    both = np.concatenate([system.xi_columns[contact], system.theta_columns[contact]])
    return both[both >= 0]


def _columns(contacts: Sequence[Contact], n_joints: int, planar: bool) -> tuple[IntArray, IntArray, int]:
    """Number the free contact variables after the joints."""
    xi = np.full((len(contacts), 2), -1, dtype=np.int64)
    theta = np.full((len(contacts), 3), -1, dtype=np.int64)
    column = n_joints
    for i, contact in enumerate(contacts):
        kind = contact.kind if not contact.slides else "hard" if contact.led else "frictionless"
        for k, free in enumerate(_FREE[kind]):
            if free and (not planar or k in (1, 2)):
                (xi[i] if k < 2 else theta[i])[k if k < 2 else k - 2] = column
                column += 1
    return xi, theta, column
