"""What acts on the held object besides its weight: external wrenches, and what no model has."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.controllers.grasp_dynamics import GraspState


@dataclass(frozen=True, eq=False)
class ObservedWrenches:
    """Wrenches about the object's centre, world axes, shape (6,) each.

    Attributes:
        external: From the surroundings: pushes.
        unmodelled: What else keeps the object from the acceleration it was told, chiefly the torques by which
            contacts resist turning and rolling.
    """

    external: FloatArray
    unmodelled: FloatArray


class WrenchObserver:
    """Tells pushes from errors of the model, by the object's motion and the fingertips' forces.

    The external wrench is what the object's motion needs beyond its weight and the felt contact forces. What
    the motion lacks after that is unmodelled; a first-order filter follows it (a disturbance observer).
    Torques about the contacts' normals are not felt, so they count as external where the object has them.

    Args:
        time_step_s: Time step.
        time_constant_s: Of the filter; 0 observes nothing unmodelled.
    """

    def __init__(self, time_step_s: float, time_constant_s: float) -> None:
        self._dt = time_step_s
        self._share = -np.expm1(-time_step_s / time_constant_s) if time_constant_s > 0.0 else 0.0
        self._commanded: tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None = None
        self._wrenches = ObservedWrenches(np.zeros(6), np.zeros(6))

    def observe(self, state: GraspState, gravity_wrench: FloatArray, felt: FloatArray) -> ObservedWrenches:
        """Return the wrenches of the step before.

        Args:
            state: The present state.
            gravity_wrench: The weight, shape (6,).
            felt: Wrench of the fingertips on the object in the step before, shape (6,).
        """
        if self._commanded is None:
            return self._wrenches
        twist, acceleration, used, inertia = self._commanded
        real = (state.twist - twist) / self._dt
        external = state.inertia @ real + state.gyroscopic - gravity_wrench - felt
        unmodelled = self._wrenches.unmodelled
        found = inertia @ (real - acceleration) - (external - used) + unmodelled
        self._wrenches = ObservedWrenches(external, unmodelled + self._share * (found - unmodelled))
        return self._wrenches

    def command(self, state: GraspState, acceleration: FloatArray, external: FloatArray) -> None:
        """Remember the acceleration that was asked for, and the external wrench that was counted on."""
        self._commanded = state.twist, acceleration, external, state.inertia_with_fingers()

    def memory(self) -> tuple[object, object]:
        """Return what `recall` takes."""
        return self._commanded, self._wrenches

    def recall(self, memory: tuple[object, object]) -> None:
        """Return to a time before."""
        self._commanded, self._wrenches = memory  # type: ignore[assignment]
