"""Computed torque: the object's pose error dies out like a linear oscillator (thesis 2.3.1)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.controllers.grasp_dynamics import GraspState
from graspbench.simulation.controllers.object_level import LinearizedControl, Wanted
from graspbench.simulation.controllers.second_order import SecondOrder
from graspbench.simulation.stage import Stage
from graspbench.simulation.touch import Touch


class ComputedTorque(LinearizedControl):
    """a = a_goal - 2 zeta w e' - w^2 (e + r * integral of e): all dynamics cancelled, PID on the rest.

    A push feels the mass of object and fingers, and w^2 times that as a stiffness; the integral takes a
    lasting one away.
    """

    def __init__(self, stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> None:
        super().__init__(stage, fingers, touches)
        p = stage.parameters.computed_torque
        self._parameters = p
        damping, stiffness = 2.0 * p.damping_ratio * p.bandwidth_rad_s, p.bandwidth_rad_s**2
        self.model = (1.0, damping, stiffness)
        self._stiffness = stiffness
        self._feedback = SecondOrder(1.0, damping, stiffness, stage.time_step_s)
        self._sum = np.zeros(6)

    def memory(self) -> Any:
        """Return what `recall` takes to return to the present."""
        return super().memory(), self._sum

    def recall(self, memory: Any) -> None:
        """Return to a time before."""
        own, self._sum = memory
        super().recall(own)

    def _law(self, error: FloatArray, rate: FloatArray, state: GraspState) -> Wanted:
        self._sum = self._sum + self._dt * error
        lasting = self._stiffness * self._parameters.integral_rate_hz * self._sum
        return Wanted(self._feedback.acceleration(error, rate, np.zeros(6)) - lasting, np.zeros(6))
