"""Keep joints away from their limits."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays, TaskArrays
from graspbench.manipulation.compiled.task_kernel import TaskKernel, task_kernel
from graspbench.manipulation.compiled.task_rows import beyond, open_row, smooth_step
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.secondary_task import TASKS, CompiledTask, PackedTask, check_members


class JointLimitArrays(TaskArrays):
    """What the kernel reads."""

    margin: float
    joints: Annotated[IntArray, "watched"]
    limits: Annotated[FloatArray, "watched", 2]


@task_kernel
def joint_limit_rows(system: SystemArrays, state: StateArrays, task: JointLimitArrays) -> int:
    """Write a row for every joint within the margin."""
    joints, limits, margin, count = state.joints, task.limits, task.margin, 0
    for k in range(len(limits)):
        joint = task.joints[k]
        depth, back = beyond(joints[joint], limits[k, 0], limits[k, 1], margin)
        if depth > 0.0:
            # full strength half-way into the margin, so that the limit itself is never needed
            open_row(task, count, joints[joint], back, smooth_step(2.0 * depth / margin))
            task.jacobian[count, joint] = 1.0
            count += 1
    return count


@TASKS.register("joint_limit")
@dataclass(frozen=True, kw_only=True)
class JointLimit(CompiledTask):
    """Push a joint back once it is within the margin of a limit; every joint comes and goes on its own."""

    KERNEL: ClassVar[TaskKernel] = joint_limit_rows
    SEPARATE_ROWS: ClassVar[bool] = True

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 20.0
    joints: Annotated[tuple[int, ...], Field(description="Joints to watch; all if empty")] = ()
    lower: Annotated[tuple[float, ...], Field(description="Lower limits, rad; the hand's if empty")] = ()
    upper: Annotated[tuple[float, ...], Field(description="Upper limits, rad; the hand's if empty")] = ()
    margin: Annotated[float, Field(gt=0, description="Where the task begins, before the limit, rad")] = 0.1

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return a row for every watched joint: the joint itself, away from the nearer limit."""
        tree = system.tree
        joints = self.joints or tuple(range(tree.n_joints))
        check_members("joint_limit", "joints", joints, tree.n_joints)
        lower = self.lower or tuple(tree.lower[list(joints)])
        upper = self.upper or tuple(tree.upper[list(joints)])
        if not len(lower) == len(upper) == len(joints):
            raise ConfigurationError(
                f"the task joint_limit watches {len(joints)} joints but has {len(lower)} lower and "
                f"{len(upper)} upper limits"
            )
        limits = np.column_stack([lower, upper])
        return PackedTask(len(joints), {"margin": self.margin, "joints": joints, "limits": limits})
