"""Keep the grasp stiff along a direction."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.errors import ConfigurationError
from graspbench.manipulation.compiled.task_rows import smooth_step
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.secondary_task import TASKS, SecondaryTask, TaskValue
from graspbench.manipulation.task_geometry import resistance, unit_twist


@TASKS.register("grasp_stiffness")
@dataclass(frozen=True, kw_only=True)
class GraspStiffness(SecondaryTask):
    """Raise the stiffness with which springs in the joints hold the object, where it is below a threshold.

    It is u' G (J K_q^-1 J' + c I)^-1 G' u with c the compliance of the tips (Cutkosky and Kao 1989); the part
    that comes from a change of the contact forces' direction is left out.
    """

    FOLLOWS: ClassVar[Mapping[str, str]] = {"joint_stiffness_nm_rad": "execution.stiffness_nm_rad"}

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 2.0
    translation: Annotated[
        tuple[float, float, float], Field(description="Direction of translation, palm axes")
    ] = (0.0, 0.0, 1.0)
    rotation: Annotated[
        tuple[float, float, float],
        Field(description="Rotation that goes with it, rad per unit of translation, palm axes"),
    ] = (0.0, 0.0, 0.0)
    joint_stiffness_nm_rad: Annotated[
        float | None,
        Field(gt=0, description="Stiffness of every joint, N m/rad; null: execution.stiffness_nm_rad"),
    ] = None
    tip_compliance_m_per_n: Annotated[
        float, Field(ge=0, description="Compliance of every tip, m/N; 0: rigid")
    ] = 0.0
    threshold: Annotated[
        float, Field(gt=0, description="Stiffness below which the task acts, N/m (rotation: N m/rad)")
    ] = 1000.0

    def __post_init__(self) -> None:
        if not any((*self.translation, *self.rotation)):
            raise ConfigurationError("the task grasp_stiffness has no direction")

    def evaluate(self, state: State) -> TaskValue | None:
        """Return the stiffness, or None where there is enough of it, or no bound."""
        twist = unit_twist(self.translation, self.rotation)
        spring = 10.0 if self.joint_stiffness_nm_rad is None else self.joint_stiffness_nm_rad
        compliance = np.full(state.system.n_joints, 1.0 / spring)
        found = resistance(state, twist, compliance, self.tip_compliance_m_per_n)
        if found is None or found.value >= self.threshold:
            return None
        error = np.array([self.threshold - found.value])
        activation = smooth_step(2.0 * (1.0 - found.value / self.threshold))
        return TaskValue(np.array([found.value]), found.gradient[None], error, activation)
