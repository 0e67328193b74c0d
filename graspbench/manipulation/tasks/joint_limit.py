"""Keep joints away from their limits."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numba import njit
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.task import TASKS, Task, TaskValue


@TASKS.register("joint_limit")
@dataclass(frozen=True, kw_only=True)
class JointLimit(Task):
    """Push a joint back once it is within the margin of a limit; every joint comes and goes on its own."""

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 20.0
    joints: Annotated[tuple[int, ...], Field(description="Joints to watch; all if empty")] = ()
    lower: Annotated[tuple[float, ...], Field(description="Lower limits, rad; the hand's if empty")] = ()
    upper: Annotated[tuple[float, ...], Field(description="Upper limits, rad; the hand's if empty")] = ()
    margin: Annotated[float, Field(gt=0, description="Where the task begins, before the limit, rad")] = 0.1

    @cached_property
    def _given(self) -> tuple[IntArray, FloatArray, FloatArray]:
        return np.array(self.joints, dtype=np.int64), np.array(self.lower), np.array(self.upper)

    def evaluate(self, state: State) -> TaskValue | None:
        """Return one row for every joint inside the margin, or None."""
        tree = state.system.tree
        joints, lower, upper = self._given
        if not self.joints:
            joints = tree.joints
        if not self.lower:
            lower = tree.lower[joints] if self.joints else tree.lower
        if not self.upper:
            upper = tree.upper[joints] if self.joints else tree.upper
        near = np.empty(len(joints), dtype=np.int64)
        count = _near(state.joints, joints, lower, upper, self.margin, near)
        if count == 0:
            return None
        jacobian, rows = np.zeros((count, state.system.n_variables)), np.empty((3, count))
        _rows(state.joints, joints, lower, upper, self.margin, near, jacobian, rows)
        return TaskValue(rows[0], jacobian, rows[1], rows[2])


@njit(cache=True)
def _near(
    q: FloatArray, joints: IntArray, lower: FloatArray, upper: FloatArray, margin: float, near: IntArray
) -> int:
    """Write which of the joints are inside a margin; return how many."""
    count = 0
    for k in range(len(joints)):
        if q[joints[k]] > upper[k] - margin or q[joints[k]] < lower[k] + margin:
            near[count] = k
            count += 1
    return count


@njit(cache=True)
def _rows(
    q: FloatArray,
    joints: IntArray,
    lower: FloatArray,
    upper: FloatArray,
    margin: float,
    near: IntArray,
    jacobian: FloatArray,
    rows: FloatArray,
) -> None:
    """Write value, error and activation of every joint inside a margin."""
    for row in range(len(jacobian)):
        k = near[row]
        joint = joints[k]
        above, below = q[joint] - (upper[k] - margin), (lower[k] + margin) - q[joint]
        jacobian[row, joint] = 1.0
        rows[0, row] = q[joint]
        rows[1, row] = -above if above > below else below
        # full strength half-way into the margin, so that the limit itself is never needed
        x = min(2.0 * max(above, below) / margin, 1.0)
        rows[2, row] = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
