"""Keep a finger away from its singular configurations."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numba import njit
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.task import TASKS, Task, TaskValue, smooth_step


@TASKS.register("manipulability")
@dataclass(frozen=True, kw_only=True)
class Manipulability(Task):
    """Raise a finger's manipulability sqrt(det(J J^T)) (Yoshikawa 1985) once it is below a threshold."""

    finger: Annotated[int, Field(ge=0, description="The finger")] = 0
    threshold: Annotated[
        float, Field(gt=0, description="Manipulability below which the task acts, m^3 (planar: m^2)")
    ] = 3e-5

    def evaluate(self, state: State) -> TaskValue | None:
        """Return the manipulability of the tip's position, or None above the threshold."""
        system = state.system
        own = np.flatnonzero(system.arrays.paths[self.finger])
        rows = 2 if system.planar else 3
        gradient = np.zeros((1, system.n_variables))
        columns = state.tip_jacobians[self.finger, :3, own]  # (k, 3)
        axes = state.joint_axes[own]
        block = np.ascontiguousarray(columns[:, :rows].T)
        gram = block @ block.T
        determinant = np.linalg.det(gram)
        value = float(np.sqrt(max(determinant, 0.0)))
        if value >= self.threshold or value == 0.0:  # at a singularity the gradient does not exist
            return None
        dual = value * np.linalg.solve(gram, block)
        out = np.zeros(len(own))
        _gradient(np.ascontiguousarray(columns), axes, dual, out)
        gradient[0, own] = out
        activation = smooth_step(2.0 * (1.0 - value / self.threshold))
        return TaskValue(np.array([value]), gradient, np.array([self.threshold - value]), activation)


@njit(cache=True)
def _gradient(columns: FloatArray, axes: FloatArray, dual: FloatArray, out: FloatArray) -> None:
    """Write sum(dual * dJ/dq_k): column j turns as axis_min(j, k) x column_max(j, k) with joint k."""
    for k in range(len(out)):
        for j in range(len(out)):
            low, high = min(j, k), max(j, k)
            for a in range(len(dual)):
                b, c = (a + 1) % 3, (a + 2) % 3
                turn = axes[low, b] * columns[high, c] - axes[low, c] * columns[high, b]
                out[k] += dual[a, j] * turn
