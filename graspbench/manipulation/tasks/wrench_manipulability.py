"""Keep the hand able to press or turn the object along a direction with little joint torque."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.errors import ConfigurationError
from graspbench.manipulation.compiled.task_rows import smooth_step
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.secondary_task import TASKS, SecondaryTask, TaskValue
from graspbench.manipulation.task_geometry import contact_motion, joint_curvature, stacked_tips, unit_twist


@TASKS.register("wrench_manipulability")
@dataclass(frozen=True, kw_only=True)
class WrenchManipulability(SecondaryTask):
    """Raise the wrench on the object along a direction per unit of joint torque, below a threshold.

    It is the radius of the wrench manipulability ellipsoid of the hand with the object (Chiu 1988; Chiacchio,
    Chiaverini, Sciavicco and Siciliano 1991), 1 / |J' f| with f = G' (G G')^-1 u the least contact forces
    that make the wrench u. It takes three contacts that are not on a line.
    """

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 2.0
    force: Annotated[tuple[float, float, float], Field(description="Direction of the force, palm axes")] = (
        0.0,
        0.0,
        1.0,
    )
    torque: Annotated[
        tuple[float, float, float],
        Field(description="Torque about the object's origin that goes with it, m, palm axes"),
    ] = (0.0, 0.0, 0.0)
    threshold: Annotated[
        float, Field(gt=0, description="Wrench per joint torque below which the task acts, 1/m (or 1)")
    ] = 20.0

    def __post_init__(self) -> None:
        if not any((*self.force, *self.torque)):
            raise ConfigurationError("the task wrench_manipulability has no direction")

    def evaluate(self, state: State) -> TaskValue | None:
        """Return the wrench, or None where there is enough of it or the contacts cannot make it."""
        system, levers = state.system, state.levers
        wrench = unit_twist(self.force, self.torque)
        grasp = np.zeros((6, 3 * system.n_contacts))
        for i, lever in enumerate(levers):
            grasp[:3, 3 * i : 3 * i + 3] = np.eye(3)
            grasp[3:, 3 * i : 3 * i + 3] = np.cross(lever, np.eye(3)).T
        gram = grasp @ grasp.T
        if np.linalg.cond(gram) > 1e12:
            return None
        dual = np.linalg.solve(gram, wrench)
        forces = (grasp.T @ dual).reshape(-1, 3)
        jacobian = stacked_tips(state)
        torques = jacobian.T @ forces.ravel()
        square = float(torques @ torques)
        if square == 0.0 or square**-0.5 >= self.threshold:
            return None
        # d|J'f|^2 = 2 y' dJ' f + 2 (J y)' df, with df = dG' w - G' (G G')^-1 (dG f + G dG' w)
        tips = (jacobian @ torques).reshape(-1, 3)
        back = np.linalg.solve(gram, grasp @ tips.ravel())
        gradient = np.zeros(system.n_variables)
        for i in range(system.n_contacts):
            own = tips[i] - back[:3] - np.cross(back[3:], levers[i])
            over_lever = np.cross(own, dual[3:]) - np.cross(forces[i], back[3:])
            gradient += over_lever @ contact_motion(state, i).lever
            gradient[: system.n_joints] += joint_curvature(state, i, forces[i], torques)
        value = square**-0.5
        activation = smooth_step(2.0 * (1.0 - value / self.threshold))
        return TaskValue(
            np.array([value]),
            -(value**3) * gradient[None],
            np.array([self.threshold - value]),
            activation,
        )
