"""Keep a finger away from its singular configurations."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.compiled import inner
from graspbench.manipulation.compiled.step_records import StateArrays, SystemArrays, TaskArrays
from graspbench.manipulation.compiled.task_kernel import TaskKernel, task_kernel
from graspbench.manipulation.compiled.task_rows import open_row, smooth_step
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.secondary_task import TASKS, CompiledTask, PackedTask, check_members


class ManipulabilityArrays(TaskArrays):
    """What the kernel reads."""

    finger: int
    threshold: float


@task_kernel
def manipulability_rows(system: SystemArrays, state: StateArrays, task: ManipulabilityArrays) -> int:
    """Write a row where the finger's manipulability is below the threshold.

    d sqrt(det(J J^T)) = value tr((J J^T)^-1 J dJ^T); column j of J turns as axis_min(j, k) x column_max(j, k)
    with joint k.
    """
    tip, axes, path = state.tip_jacobians[task.finger], state.joint_axes, system.paths[task.finger]
    n_q, n_rows, threshold = len(path), 3 if len(system.twist_components) == 6 else 2, task.threshold
    gram, inverse = np.eye(3), np.empty((3, 3))
    for a in range(n_rows):
        for b in range(n_rows):
            gram[a, b] = 0.0
            for q in range(n_q):
                gram[a, b] += tip[a, q] * tip[b, q]
    value = math.sqrt(max(_inverse3(gram, inverse), 0.0))
    if value >= threshold or value == 0.0:  # at a singularity the gradient does not exist
        return 0
    open_row(task, 0, value, threshold - value, smooth_step(2.0 * (1.0 - value / threshold)))
    jacobian = task.jacobian
    for j in range(n_q):
        for a in range(n_rows):
            dual = 0.0
            for b in range(n_rows):
                dual += value * inverse[a, b] * tip[b, j]
            b, c = (a + 1) % 3, (a + 2) % 3
            for k in range(n_q):
                if path[j] and path[k]:
                    low, high = min(j, k), max(j, k)
                    jacobian[0, k] += dual * (axes[low, b] * tip[c, high] - axes[low, c] * tip[b, high])
    return 1


@inner
def _inverse3(matrix: FloatArray, inverse: FloatArray) -> float:
    """Write the inverse of a symmetric (3, 3) matrix by cofactors; return the determinant."""
    for a in range(3):
        for b in range(3):
            p, q, r, s = (a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3
            inverse[a, b] = matrix[p, r] * matrix[q, s] - matrix[p, s] * matrix[q, r]
    determinant = 0.0
    for b in range(3):
        determinant += matrix[0, b] * inverse[0, b]
    for a in range(3):
        for b in range(3):
            inverse[a, b] /= determinant if determinant != 0.0 else 1.0
    return determinant


@TASKS.register("manipulability")
@dataclass(frozen=True, kw_only=True)
class Manipulability(CompiledTask):
    """Raise a finger's manipulability sqrt(det(J J^T)) (Yoshikawa 1985) once it is below a threshold."""

    KERNEL: ClassVar[TaskKernel] = manipulability_rows

    finger: Annotated[int, Field(ge=0, description="The finger")] = 0
    threshold: Annotated[
        float, Field(gt=0, description="Manipulability below which the task acts, m^3 (planar: m^2)")
    ] = 3e-5

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return one row: the manipulability of the tip's position."""
        check_members("manipulability", "fingers", (self.finger,), system.n_contacts)
        return PackedTask(1, {"finger": self.finger, "threshold": self.threshold})
