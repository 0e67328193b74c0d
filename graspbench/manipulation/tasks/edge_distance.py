"""Keep contacts away from the edge of their surface."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays, TaskArrays
from graspbench.manipulation.compiled.task_kernel import TaskKernel, task_kernel
from graspbench.manipulation.compiled.task_rows import beyond, open_row, smooth_step
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.secondary_task import TASKS, CompiledTask, PackedTask, check_members


class EdgeDistanceArrays(TaskArrays):
    """What the kernel reads."""

    margin: float
    contacts: Annotated[IntArray, "watched"]
    domains: Annotated[FloatArray, "watched", 2, 2]


@task_kernel
def edge_distance_rows(system: SystemArrays, state: StateArrays, task: EdgeDistanceArrays) -> int:
    """Write a row for every coordinate that is near an edge and can move."""
    variables, rates, domains, count = state.contact_variables, state.xi_jacobians, task.domains, 0
    for c in range(len(domains)):
        i = task.contacts[c]
        for k in range(2):
            low, high = domains[c, k, 0], domains[c, k, 1]
            margin, moves = task.margin * (high - low), False
            depth, back = beyond(variables[i, k], low, high, margin)
            for v in range(rates.shape[2]):
                moves |= rates[i, k, v] != 0.0
            if depth > 0.0 and moves:
                open_row(task, count, variables[i, k], back, smooth_step(2.0 * depth / margin))
                for v in range(rates.shape[2]):
                    task.jacobian[count, v] = rates[i, k, v]
                count += 1
    return count


@TASKS.register("edge_distance")
@dataclass(frozen=True, kw_only=True)
class EdgeDistance(CompiledTask):
    """Push a contact inwards once it is near the edge of its chart's domain."""

    KERNEL: ClassVar[TaskKernel] = edge_distance_rows
    SEPARATE_ROWS: ClassVar[bool] = True

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 10.0
    contacts: Annotated[tuple[int, ...], Field(description="Contacts to watch; all if empty")] = ()
    margin: Annotated[
        float, Field(gt=0, lt=0.5, description="Where the task begins, as a share of the domain")
    ] = 0.15

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return a row for every coordinate that is near an edge and can move."""
        watched = self.contacts or tuple(range(system.n_contacts))
        check_members("edge_distance", "contacts", watched, system.n_contacts)
        domains = [system.contacts[i].chart.domain for i in watched]
        given = {"margin": self.margin, "contacts": watched, "domains": domains}
        return PackedTask(2 * len(watched), given)
