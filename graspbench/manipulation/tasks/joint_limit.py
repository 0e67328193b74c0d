"""Keep joints away from their limits."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numba import njit
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.task import TASKS, Task, TaskValue, smooth_steps


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
            joints = np.arange(tree.n_joints)
        if not self.lower:
            lower = tree.lower[joints]
        if not self.upper:
            upper = tree.upper[joints]
        errors, near = np.empty(len(joints)), np.empty(len(joints), dtype=np.int64)
        count = _violations(state.joints, joints, lower, upper, self.margin, errors, near)
        if count == 0:
            return None
        errors, near = errors[:count], near[:count]
        jacobian = np.zeros((count, state.system.n_variables))
        jacobian[np.arange(count), near] = 1.0
        # full strength half-way into the margin, so that the limit itself is never needed
        return TaskValue(
            state.joints[near], jacobian, errors, smooth_steps(np.abs(errors) * (2.0 / self.margin))
        )


@njit(cache=True)
def _violations(
    q: FloatArray,
    joints: IntArray,
    lower: FloatArray,
    upper: FloatArray,
    margin: float,
    errors: FloatArray,
    near: IntArray,
) -> int:
    """Write the way back out of the margin for every joint inside one; return how many there are."""
    count = 0
    for k in range(len(joints)):
        above = q[joints[k]] - (upper[k] - margin)
        below = (lower[k] + margin) - q[joints[k]]
        if above > 0.0 or below > 0.0:
            errors[count] = -above if above > below else below
            near[count] = joints[k]
            count += 1
    return count
