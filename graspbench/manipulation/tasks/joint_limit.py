"""Keep joints away from their limits."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

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

    def evaluate(self, state: State) -> TaskValue | None:
        """Return one row for every joint inside the margin, or None."""
        tree = state.system.tree
        chosen = np.array(self.joints, dtype=np.int64) if self.joints else np.arange(tree.n_joints)
        lower = np.array(self.lower) if self.lower else tree.lower[chosen]
        upper = np.array(self.upper) if self.upper else tree.upper[chosen]
        q = state.joints[chosen]
        above, below = q - (upper - self.margin), (lower + self.margin) - q
        near = np.flatnonzero(np.maximum(above, below) > 0.0)
        if near.size == 0:
            return None
        above, below = above[near], below[near]
        jacobian = np.zeros((near.size, state.system.n_variables))
        jacobian[np.arange(near.size), chosen[near]] = 1.0
        # full strength half-way into the margin, so that the limit itself is never needed
        inside = np.maximum(above, below) / self.margin
        error = np.where(above > below, -above, below)
        return TaskValue(q[near], jacobian, error, smooth_steps(2.0 * inside))
