"""Hybrid force and position control of every finger by itself (thesis 2.3.3)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.controllers.grasp_dynamics import GraspState
from graspbench.simulation.controllers.object_level import ObjectLevelControl
from graspbench.simulation.stage import Stage
from graspbench.simulation.touch import Touch

_JOINT_DAMPING = 0.05
"""Of `damping_nms_rad`, in the joints besides: the finger's free motion comes to rest."""
_WINDUP = 0.5
"""Of the force asked for, the most that the integral adds."""


class HybridControl(ObjectLevelControl):
    """Force along each contact's normal, place of the fingertip along the surface.

    Along the normal a finger presses as grip and weight want it, with an integral of what it feels too much
    or too little; along the surface the tip is a spring and a damper around where the object's goal has it
    (Raibert and Craig 1981, with the contact frame as the frame of constraint).
    """

    def __init__(self, stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> None:
        super().__init__(stage, fingers, touches)
        self._parameters = stage.parameters.hybrid
        self._tips_on_object = np.zeros((len(fingers), 3))
        self._sums = np.zeros(len(fingers))

    def memory(self) -> Any:
        """Return what `recall` takes to return to the present."""
        return super().memory(), self._sums

    def recall(self, memory: Any) -> None:
        """Return to a time before."""
        own, self._sums = memory
        super().recall(own)

    def _take_over(self) -> None:
        super()._take_over()
        pose = self._stage.world.object_pose()
        tips = self._stage.hand.tip_poses(self._fingers)[:, :3, 3]
        self._tips_on_object = (tips - pose[:3, 3]) @ pose[:3, :3]

    def _torques(self, state: GraspState, step: Any, touches: Sequence[Touch]) -> FloatArray:
        p = self._parameters
        planned = self._forces_for(
            state,
            state.inertia @ (step.goal_twist - step.twist_before) / self._dt - self._dynamics.gravity_wrench,
        ).reshape(-1, 3)
        tips = self._stage.hand.tip_poses(self._fingers)[:, :3, 3]
        goals = self._tips_on_object @ step.goal[:3, :3].T + step.goal[:3, 3]
        moving = (state.contact_jacobian @ state.velocities + state.palm_velocities).reshape(-1, 3)
        arms = np.stack([touch.point for touch in touches]) - state.pose[:3, 3]
        wanted = step.goal_twist[:3] + np.cross(step.goal_twist[3:], arms)
        pull = p.stiffness_n_per_m * (goals - tips) + p.damping_ns_per_m * (wanted - moving)
        forces = np.empty_like(planned)
        sums = self._sums.copy()
        for i, touch in enumerate(touches):
            normal, asked = touch.normal, float(planned[i] @ touch.normal)
            sums[i] += self._dt * p.force_integral_hz * (asked - touch.force_n)
            sums[i] = np.clip(sums[i], -_WINDUP * abs(asked), _WINDUP * abs(asked))
            along = pull[i] - (pull[i] @ normal) * normal
            forces[i] = planned[i] + sums[i] * normal + along
        self._sums = sums
        return np.asarray(state.bias + state.contact_jacobian.T @ forces.ravel())

    def _springs(self, state: GraspState) -> tuple[FloatArray, FloatArray]:
        damping = _JOINT_DAMPING * self._stage.parameters.damping_nms_rad
        return -damping * state.velocities, np.zeros_like(state.velocities)
