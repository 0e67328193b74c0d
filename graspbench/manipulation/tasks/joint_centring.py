"""Draw joints towards a posture."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.task import TASKS, Task, TaskValue


@TASKS.register("joint_centring")
@dataclass(frozen=True, kw_only=True)
class JointCentring(Task):
    """Draw joints towards the middle of their ranges, or a given posture, as far as all else allows."""

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 1.0
    posture: Annotated[tuple[float, ...], Field(description="Wanted joints, rad; mid-range if empty")] = ()

    def evaluate(self, state: State) -> TaskValue:
        """Return the joints, one row each."""
        tree = state.system.tree
        centre = np.array(self.posture) if self.posture else tree.mid_range
        jacobian = np.eye(tree.n_joints, state.system.n_variables)
        return TaskValue(state.joints.copy(), jacobian, centre - state.joints)
