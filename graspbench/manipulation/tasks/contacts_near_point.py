"""Grasp quality: keep contacts near a point of the object."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays, TaskArrays
from graspbench.manipulation.compiled.task_kernel import TaskKernel, task_kernel
from graspbench.manipulation.compiled.task_rows import add_point_rates, open_row
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.secondary_task import TASKS, CompiledTask, PackedTask, check_members


class ContactsNearPointArrays(TaskArrays):
    """What the kernel reads."""

    reach_m: float
    point_m: Annotated[FloatArray, 3]
    contacts: Annotated[IntArray, "pulled"]
    middle_of: Annotated[IntArray, "others"]


@task_kernel
def contacts_near_point_rows(system: SystemArrays, state: StateArrays, task: ContactsNearPointArrays) -> int:
    """Write three rows a contact: its offset from the target in the object frame."""
    points, others, errors = state.surface_points, task.middle_of, task.errors
    n_others = len(others)
    for n in range(len(task.contacts)):
        i, square = task.contacts[n], 0.0
        for a in range(3):
            row, target = 3 * n + a, 0.0 if n_others > 0 else task.point_m[a]
            for k in range(n_others):
                target += points[others[k], a] / n_others
            offset = points[i, a] - target
            square += offset * offset
            open_row(task, row, offset, -offset, 1.0)
            add_point_rates(state, i, a, 1.0, task, row)
            for k in range(n_others):
                add_point_rates(state, others[k], a, -1.0 / n_others, task, row)
        for a in range(3):
            errors[3 * n + a] /= math.sqrt(1.0 + square / (task.reach_m * task.reach_m))
    return 3 * len(task.contacts)


@TASKS.register("contacts_near_point")
@dataclass(frozen=True, kw_only=True)
class ContactsNearPoint(CompiledTask):
    """Pull contacts over the surface towards a point, or towards the middle of other contacts."""

    KERNEL: ClassVar[TaskKernel] = contacts_near_point_rows

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 1.0
    contacts: Annotated[tuple[int, ...], Field(min_length=1, description="Contacts to pull")] = (0,)
    middle_of: Annotated[
        tuple[int, ...], Field(description="Contacts whose mean is the target; empty: the point")
    ] = ()
    point_m: Annotated[tuple[float, float, float], Field(description="Target in the object frame, m")] = (
        0.0,
        0.0,
        0.0,
    )
    reach_m: Annotated[float, Field(gt=0, description="Distance beyond which the pull saturates, m")] = 0.3

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return three rows a contact: its offset from the target in the object frame."""
        named = (*self.contacts, *self.middle_of)
        check_members("contacts_near_point", "contacts", named, system.n_contacts)
        own = ("reach_m", "point_m", "contacts", "middle_of")
        return PackedTask(3 * len(self.contacts), {name: getattr(self, name) for name in own})
