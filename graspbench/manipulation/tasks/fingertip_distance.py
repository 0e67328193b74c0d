"""Keep two fingertips apart."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.task import TASKS, Task, TaskValue, smooth_step


@TASKS.register("fingertip_distance")
@dataclass(frozen=True, kw_only=True)
class FingertipDistance(Task):
    """Push a pair of tips apart once it is closer than the threshold."""

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 10.0
    first: Annotated[int, Field(ge=0, description="One finger")] = 0
    second: Annotated[int, Field(ge=0, description="The other finger")] = 1
    minimum_m: Annotated[float, Field(ge=0, description="Distance to keep, m")] = 0.02
    threshold_m: Annotated[float, Field(gt=0, description="Distance at which the task begins, m")] = 0.03

    def evaluate(self, state: State) -> TaskValue | None:
        """Return the distance of the two tips' centres, or None beyond the threshold."""
        between = state.tip_positions[self.second] - state.tip_positions[self.first]
        distance = float(np.sqrt(between @ between))
        if distance >= self.threshold_m:
            return None
        jacobian = np.zeros((1, state.system.n_variables))
        relative = state.tip_jacobians[self.second, :3] - state.tip_jacobians[self.first, :3]
        jacobian[0, : state.system.n_joints] = between @ relative / max(distance, 1e-9)
        span = self.threshold_m - self.minimum_m
        activation = smooth_step((self.threshold_m - distance) / span)
        return TaskValue(np.array([distance]), jacobian, np.array([self.threshold_m - distance]), activation)
