"""A hand that must also be able to carry the object: for what turned out too heavy for the planned grasp."""

from collections.abc import Callable, Sequence

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.hand.checker import HeldContacts
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture
from graspbench.planning.constraint import HandConstraint

TOO_WEAK = "joints too weak for the weight"

Carries = Callable[[HandPosture, FloatArray, FloatArray, float], bool]
"""Whether a posture with contacts and outward normals, shape (n_f, 3) each, carries a weight, N."""


class LoadedHand:
    """The constraints of a hand, and one more: postures that cannot carry a weight count as none.

    Args:
        hand: The hand's own constraints.
        carries: What tells whether it carries a weight.
        wanted_n: What it has to carry, N.
    """

    def __init__(self, hand: HandConstraint, carries: Carries, wanted_n: float) -> None:
        self._hand, self._carries, self._wanted_n = hand, carries, wanted_n
        self.pair_limit_m = hand.pair_limit_m

    @property
    def hand(self) -> HandModel:
        """The hand."""
        return self._hand.hand

    @property
    def ground_height_m(self) -> float | None:
        """Height of the ground; None for none."""
        return self._hand.ground_height_m

    def vertex_mask(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        """As `GraspConstraint.vertex_mask`."""
        return self._hand.vertex_mask(points, normals)

    def place(
        self, points: FloatArray, normals: FloatArray, *, start: HandPosture | None = None
    ) -> HandPosture | None:
        """As `Placer.place`, strong enough."""
        return self._strong(self._hand.place(points, normals, start=start), points, normals)

    def place_near(
        self, points: FloatArray, normals: FloatArray, near: Sequence[HeldContacts]
    ) -> HandPosture | None:
        """As `GraspConstraint.place_near`, strong enough."""
        return self._strong(self._hand.place_near(points, normals, near), points, normals)

    def place_patiently(
        self, points: FloatArray, normals: FloatArray, near: Sequence[HeldContacts]
    ) -> HandPosture | None:
        """As `GraspConstraint.place_patiently`, strong enough."""
        return self._strong(self._hand.place_patiently(points, normals, near), points, normals)

    def excludes(self, points: FloatArray, normals: FloatArray) -> bool:
        """As `GraspConstraint.excludes`; nothing is proved about weights."""
        return self._hand.excludes(points, normals)

    def reason(self, points: FloatArray, normals: FloatArray) -> str:
        """Say why ``place`` returns None for these contacts."""
        if self._hand.place(points, normals) is None:
            return self._hand.reason(points, normals)
        return TOO_WEAK

    def set_object(self, points: FloatArray | None, faces: IntArray | None = None) -> None:
        """As `HandConstraint.set_object`."""
        self._hand.set_object(points, faces)

    def _strong(
        self, posture: HandPosture | None, points: FloatArray, normals: FloatArray
    ) -> HandPosture | None:
        if posture is None or not self._carries(posture, points, normals, self._wanted_n):
            return None
        return posture
