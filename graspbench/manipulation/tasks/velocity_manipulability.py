"""Keep the object easy to move along a direction."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.errors import ConfigurationError
from graspbench.manipulation.compiled.task_rows import smooth_step
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.secondary_task import TASKS, SecondaryTask, TaskValue
from graspbench.manipulation.task_geometry import resistance, unit_twist


@TASKS.register("velocity_manipulability")
@dataclass(frozen=True, kw_only=True)
class VelocityManipulability(SecondaryTask):
    """Raise the velocity of the object along a direction per unit of joint velocity, below a threshold.

    It is the radius of the velocity manipulability ellipsoid of the hand with the object (Chiu 1988;
    Chiacchio, Chiaverini, Sciavicco and Siciliano 1991): 1 / sqrt(u' G (J J')^-1 G' u).
    """

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 2.0
    translation: Annotated[
        tuple[float, float, float], Field(description="Direction of translation, palm axes")
    ] = (0.0, 0.0, 1.0)
    rotation: Annotated[
        tuple[float, float, float],
        Field(description="Rotation that goes with it, rad per unit of translation, palm axes"),
    ] = (0.0, 0.0, 0.0)
    threshold: Annotated[
        float, Field(gt=0, description="Velocity per joint velocity below which the task acts, m (or 1)")
    ] = 0.02

    def __post_init__(self) -> None:
        if not any((*self.translation, *self.rotation)):
            raise ConfigurationError("the task velocity_manipulability has no direction")

    def evaluate(self, state: State) -> TaskValue | None:
        """Return the velocity, or None where there is enough of it or none at all."""
        twist = unit_twist(self.translation, self.rotation)
        found = resistance(state, twist, np.ones(state.system.n_joints), 0.0)
        if found is None or found.value <= 0.0:
            return None
        value = found.value**-0.5
        if value >= self.threshold:
            return None
        jacobian = -0.5 * value / found.value * found.gradient
        activation = smooth_step(2.0 * (1.0 - value / self.threshold))
        return TaskValue(np.array([value]), jacobian[None], np.array([self.threshold - value]), activation)
