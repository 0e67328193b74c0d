"""Keep two fingertips apart."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.task import TASKS, CompiledTask, PackedTask, check_members
from graspbench.manipulation.task_kernels import FINGERTIP_DISTANCE


@TASKS.register("fingertip_distance")
@dataclass(frozen=True, kw_only=True)
class FingertipDistance(CompiledTask):
    """Push a pair of tips apart once it is closer than the threshold."""

    KIND: ClassVar[int] = FINGERTIP_DISTANCE

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 10.0
    first: Annotated[int, Field(ge=0, description="One finger")] = 0
    second: Annotated[int, Field(ge=0, description="The other finger")] = 1
    minimum_m: Annotated[float, Field(ge=0, description="Distance to keep, m")] = 0.02
    threshold_m: Annotated[float, Field(gt=0, description="Distance at which the task begins, m")] = 0.03

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return one row: the distance of the two tips' centres."""
        check_members("fingertip_distance", "fingers", (self.first, self.second), system.n_contacts)
        return PackedTask((self.first, self.second), (self.minimum_m, self.threshold_m), 1)
