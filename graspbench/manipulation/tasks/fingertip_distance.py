"""Keep two fingertips apart."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numba import njit
from pydantic import Field

from graspbench.arrays import FloatArray
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
        tips, jacobian = state.tip_positions, np.zeros((1, state.system.n_variables))
        distance = _distance(tips, state.tip_jacobians, self.first, self.second, self.threshold_m, jacobian)
        if distance >= self.threshold_m:
            return None
        activation = smooth_step((self.threshold_m - distance) / (self.threshold_m - self.minimum_m))
        return TaskValue(np.array([distance]), jacobian, np.array([self.threshold_m - distance]), activation)


@njit(cache=True)
def _distance(
    tips: FloatArray, jacobians: FloatArray, first: int, second: int, threshold: float, out: FloatArray
) -> float:
    """Return the distance of two tips; below the threshold also write its derivative."""
    square = 0.0
    for a in range(3):
        square += (tips[second, a] - tips[first, a]) ** 2
    distance = np.sqrt(square)
    if distance < threshold:
        for a in range(3):
            share = (tips[second, a] - tips[first, a]) / max(distance, 1e-9)
            for q in range(jacobians.shape[2]):
                out[0, q] += share * (jacobians[second, a, q] - jacobians[first, a, q])
    return float(distance)
