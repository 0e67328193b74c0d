"""What planners ask of a hand; `graspbench.hand.GraspChecker` answers it."""

from collections.abc import Sequence
from typing import Protocol

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.hand.checker import HeldContacts
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture


class Placer(Protocol):
    """Holds its fingertips at contacts."""

    def place(
        self, points: FloatArray, normals: FloatArray, *, start: HandPosture | None = None
    ) -> HandPosture | None:
        """Return a feasible posture with the fingertips on the contacts, or None if none was found.

        Args:
            points: Contact points in the world, shape (n_f, 3), m.
            normals: Outward unit normals there, shape (n_f, 3).
            start: A posture for similar contacts in the same order; tried first.
        """
        ...


class GraspConstraint(Placer, Protocol):
    """Constraints on grasps: what a search over a whole surface needs."""

    pair_limit_m: float
    """No two contacts of a grasp are farther apart."""

    def vertex_mask(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        """Tell which contacts can be part of any grasp, shape (n,).

        Args:
            points: Shape (n, 3), m.
            normals: Outward unit normals, shape (n, 3).
        """
        ...

    def place_patiently(
        self, points: FloatArray, normals: FloatArray, near: Sequence[HeldContacts], *, anywhere: bool = True
    ) -> HandPosture | None:
        """Look longer than ``place``.

        Args:
            points: Contact points in the world, shape (n_f, 3), m.
            normals: Outward unit normals there, shape (n_f, 3).
            near: Similar contacts that are held, in the same order; tried first.
            anywhere: Whether to look elsewhere too.
        """
        ...

    def excludes(self, points: FloatArray, normals: FloatArray) -> bool:
        """Tell whether it is proved that no posture holds the contacts; False says nothing.

        Args:
            points: Contact points in the world, shape (n_f, 3), m.
            normals: Outward unit normals there, shape (n_f, 3).
        """
        ...


class HandConstraint(GraspConstraint, Protocol):
    """Constraints together with the hand they come from: what the local planner needs."""

    @property
    def hand(self) -> HandModel:
        """The hand."""
        ...

    @property
    def ground_height_m(self) -> float | None:
        """Height of the ground; None for none."""
        ...

    def reason(self, points: FloatArray, normals: FloatArray) -> str:
        """Say why ``place`` returns None for these contacts."""
        ...

    def set_object(self, points: FloatArray | None, faces: IntArray | None = None) -> None:
        """Set the surface that palm and links must keep clear of; None for no object.

        Args:
            points: Its nodes, shape (m, 3), m.
            faces: Its triangles, shape (t, 3).
        """
        ...
