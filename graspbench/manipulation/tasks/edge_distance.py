"""Keep contacts away from the edge of their surface."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.task import TASKS, CompiledTask, PackedTask, check_members
from graspbench.manipulation.task_kernels import EDGE_DISTANCE


@TASKS.register("edge_distance")
@dataclass(frozen=True, kw_only=True)
class EdgeDistance(CompiledTask):
    """Push a contact inwards once it is near the edge of its chart's domain."""

    KIND: ClassVar[int] = EDGE_DISTANCE
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
        domains = np.concatenate([system.contacts[i].chart.domain.ravel() for i in watched])
        return PackedTask((len(watched), *watched), (self.margin, *domains), 2 * len(watched))
