"""Keep two fingertips apart."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays, TaskArrays
from graspbench.manipulation.compiled.task_kernel import TaskKernel, task_kernel
from graspbench.manipulation.compiled.task_rows import open_row, smooth_step
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.secondary_task import TASKS, CompiledTask, PackedTask, check_members


class FingertipDistanceArrays(TaskArrays):
    """What the kernel reads."""

    first: int
    second: int
    minimum_m: float
    threshold_m: float


@task_kernel
def fingertip_distance_rows(system: SystemArrays, state: StateArrays, task: FingertipDistanceArrays) -> int:
    """Write a row where the tips are closer than the threshold."""
    tips, jacobians, one, other = state.tip_positions, state.tip_jacobians, task.first, task.second
    square = 0.0
    for a in range(3):
        square += (tips[other, a] - tips[one, a]) ** 2
    distance = math.sqrt(square)
    if distance >= task.threshold_m:
        return 0
    room = task.threshold_m - distance
    open_row(task, 0, distance, room, smooth_step(room / (task.threshold_m - task.minimum_m)))
    jacobian = task.jacobian
    for a in range(3):
        share = (tips[other, a] - tips[one, a]) / max(distance, 1e-9)
        for q in range(jacobians.shape[2]):
            jacobian[0, q] += share * (jacobians[other, a, q] - jacobians[one, a, q])
    return 1


@TASKS.register("fingertip_distance")
@dataclass(frozen=True, kw_only=True)
class FingertipDistance(CompiledTask):
    """Push a pair of tips apart once it is closer than the threshold."""

    KERNEL: ClassVar[TaskKernel] = fingertip_distance_rows

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 10.0
    first: Annotated[int, Field(ge=0, description="One finger")] = 0
    second: Annotated[int, Field(ge=0, description="The other finger")] = 1
    minimum_m: Annotated[float, Field(ge=0, description="Distance to keep, m")] = 0.02
    threshold_m: Annotated[float, Field(gt=0, description="Distance at which the task begins, m")] = 0.03

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return one row: the distance of the two tips' centres."""
        check_members("fingertip_distance", "fingers", (self.first, self.second), system.n_contacts)
        own = ("first", "second", "minimum_m", "threshold_m")
        return PackedTask(1, {name: getattr(self, name) for name in own})
