"""Keep contacts away from the edge of their surface."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.task import TASKS, Task, TaskValue, smooth_steps


@TASKS.register("edge_distance")
@dataclass(frozen=True, kw_only=True)
class EdgeDistance(Task):
    """Push a contact inwards once it is near the edge of its chart's domain."""

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 10.0
    contacts: Annotated[tuple[int, ...], Field(description="Contacts to watch; all if empty")] = ()
    margin: Annotated[
        float, Field(gt=0, lt=0.5, description="Where the task begins, as a share of the domain")
    ] = 0.15

    def evaluate(self, state: State) -> TaskValue | None:
        """Return one row for every coordinate that is near an edge and can move, or None."""
        system = state.system
        values, rows, errors, depths = [], [], [], []
        for i in self.contacts or range(system.n_contacts):
            domain = system.contacts[i].chart.domain
            for k in range(2):
                low, high = domain[k]
                margin = self.margin * (high - low)
                xi = float(state.contact_variables[i, k])
                above, below = xi - (high - margin), (low + margin) - xi
                row = state.xi_jacobians[i, k]
                if max(above, below) > 0.0 and row.any():
                    values.append(xi)
                    rows.append(row)
                    errors.append(-above if above > below else below)
                    depths.append(max(above, below) / margin)
        if not rows:
            return None
        return TaskValue(
            np.array(values), np.array(rows), np.array(errors), smooth_steps(2.0 * np.array(depths))
        )
