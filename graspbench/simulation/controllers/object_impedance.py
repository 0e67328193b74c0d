"""Object impedance: the held object answers a push like a mass on a spring and a damper (thesis 2.3.9)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.controllers.grasp_dynamics import GraspState
from graspbench.simulation.controllers.object_level import LinearizedControl, Wanted
from graspbench.simulation.controllers.reference_oscillator import ReferenceOscillator
from graspbench.simulation.controllers.second_order import SecondOrder
from graspbench.simulation.controllers.wrench_observer import WrenchObserver
from graspbench.simulation.stage import Stage
from graspbench.simulation.touch import Touch


class ObjectImpedance(LinearizedControl):
    """M a + D v + K e = F of the object's error, with M, D and K as told and F as felt.

    Pushes are felt by what the object's motion needs beyond the fingertips' forces. The torques by which
    contacts resist turning and rolling are in no model, and would leave the object up to a fifth of a small
    step short of its goal; an observer makes up for them. What it is late for, a reference takes back: the
    object is led to where the oscillator would be by the felt forces.
    """

    def __init__(self, stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> None:
        super().__init__(stage, fingers, touches)
        p = stage.parameters.object_impedance
        self._parameters = p
        self._mass_kg = p.mass_kg
        self.model = p.mass_kg, p.damping_ns_per_m, p.stiffness_n_per_m
        self.pushed_model = self.model if p.feels_wrench else None
        self._shift = SecondOrder(p.mass_kg, p.damping_ns_per_m, p.stiffness_n_per_m, stage.time_step_s)
        self._turn = SecondOrder(
            p.inertia_kgm2, p.turning_damping_nms_rad, p.turning_stiffness_nm_rad, stage.time_step_s
        )
        self._observer = WrenchObserver(stage.time_step_s, p.observer_time_s)
        self._external = np.zeros(6)
        self._reference = ReferenceOscillator(self._shift, p.following_rad_s, stage.time_step_s)
        self._follows = p.feels_wrench and p.following_rad_s > 0.0

    def displace(self, offset_m: FloatArray) -> None:
        """Move the object's goal at once, palm axes, shape (3,)."""
        super().displace(offset_m)
        self._reference.displace(-self._stage.hand.palm_pose()[:3, :3] @ offset_m)

    def memory(self) -> Any:
        """Return what `recall` takes to return to the present."""
        return super().memory(), self._observer.memory(), self._external, self._reference.memory()

    def recall(self, memory: Any) -> None:
        """Return to a time before."""
        own, observed, self._external, reference = memory
        super().recall(own)
        self._observer.recall(observed)
        self._reference.recall(reference)

    def _law(self, error: FloatArray, rate: FloatArray, state: GraspState) -> Wanted:
        felt = self._stage.hand.force_on_object(state.pose[:3, 3])
        found = self._observer.observe(state, self._dynamics.gravity_wrench, felt)
        counted_on = self._external
        self._external = found.external if self._parameters.feels_wrench else np.zeros(6)
        # A push is felt a step late; till then the object was as light as it is, and gained too much speed.
        change = self._external - counted_on
        speed = np.linalg.solve(state.inertia_with_fingers(), change)[:3] - change[:3] / self._mass_kg
        gained = np.asarray(self._dt * speed, dtype=np.float64)
        law = self._reference if self._follows else self._shift
        shift = law.acceleration(error[:3], rate[:3] - gained, self._external[:3])
        acceleration = np.concatenate(
            (
                shift - gained / self._dt,
                self._turn.acceleration(error[3:], rate[3:], self._external[3:]),
            )
        )
        return Wanted(acceleration, self._external + found.unmodelled)

    def _commanded(self, state: GraspState, acceleration: FloatArray) -> None:
        self._observer.command(state, acceleration, self._external)
