"""Draw joints towards a posture."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays, TaskArrays
from graspbench.manipulation.compiled.task_kernel import TaskKernel, task_kernel
from graspbench.manipulation.compiled.task_rows import open_row
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.secondary_task import TASKS, CompiledTask, PackedTask


class JointCentringArrays(TaskArrays):
    """What the kernel reads."""

    posture: Annotated[FloatArray, "joints"]


@task_kernel
def joint_centring_rows(system: SystemArrays, state: StateArrays, task: JointCentringArrays) -> int:
    """Write a row for every joint."""
    joints, posture = state.joints, task.posture
    for q in range(len(joints)):
        open_row(task, q, joints[q], posture[q] - joints[q], 1.0)
        task.jacobian[q, q] = 1.0
    return len(joints)


@TASKS.register("joint_centring")
@dataclass(frozen=True, kw_only=True)
class JointCentring(CompiledTask):
    """Draw joints towards the middle of their ranges, or a given posture, as far as all else allows."""

    KERNEL: ClassVar[TaskKernel] = joint_centring_rows

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 1.0
    posture: Annotated[tuple[float, ...], Field(description="Wanted joints, rad; mid-range if empty")] = ()

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return a row for every joint."""
        posture = self.posture or tuple(system.tree.mid_range)
        if len(posture) != system.n_joints:
            raise ConfigurationError(
                f"the posture of the task joint_centring has {len(posture)} joints but the hand "
                f"{system.n_joints}"
            )
        return PackedTask(system.n_joints, {"posture": posture})
