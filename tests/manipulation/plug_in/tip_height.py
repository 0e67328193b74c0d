"""A compiled task of another distribution: one file, which Graspbench has never seen."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.arrays import IntArray
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays, TaskArrays
from graspbench.manipulation.compiled.task_kernel import TaskKernel, task_kernel
from graspbench.manipulation.compiled.task_rows import open_row, smooth_step
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.secondary_task import TASKS, CompiledTask, PackedTask, check_members


class TipHeightArrays(TaskArrays):
    """What the kernel reads."""

    floor_m: float
    ramp_m: float
    fingers: Annotated[IntArray, "watched"]


@task_kernel
def tip_height_rows(system: SystemArrays, state: StateArrays, task: TipHeightArrays) -> int:
    """Write a row for every watched tip that is below the floor."""
    count = 0
    for finger in task.fingers:
        depth = task.floor_m - state.tip_positions[finger, 2]
        if depth > 0.0:
            open_row(task, count, -depth, depth, smooth_step(depth / task.ramp_m))
            for q in range(len(state.joints)):
                task.jacobian[count, q] = state.tip_jacobians[finger, 2, q]
            count += 1
    return count


@TASKS.register("tip_height")
@dataclass(frozen=True, kw_only=True)
class TipHeight(CompiledTask):
    """Lift tips over a floor in the base frame."""

    KERNEL: ClassVar[TaskKernel] = tip_height_rows
    SEPARATE_ROWS: ClassVar[bool] = True

    fingers: Annotated[tuple[int, ...], Field(description="Fingers to watch")] = (0,)
    floor_m: Annotated[float, Field(description="Height to keep, m")] = 0.0
    depth_m: Annotated[float, Field(gt=0, description="Depth of full strength, m")] = 0.01

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return a row for every watched tip: its height over the floor."""
        check_members("tip_height", "fingers", self.fingers, system.n_contacts)
        given = {"floor_m": self.floor_m, "ramp_m": self.depth_m, "fingers": self.fingers}
        return PackedTask(len(self.fingers), given)
