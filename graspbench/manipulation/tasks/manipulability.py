"""Keep a finger away from its singular configurations."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.task import TASKS, CompiledTask, PackedTask, check_members
from graspbench.manipulation.task_kernels import MANIPULABILITY


@TASKS.register("manipulability")
@dataclass(frozen=True, kw_only=True)
class Manipulability(CompiledTask):
    """Raise a finger's manipulability sqrt(det(J J^T)) (Yoshikawa 1985) once it is below a threshold."""

    KIND: ClassVar[int] = MANIPULABILITY

    finger: Annotated[int, Field(ge=0, description="The finger")] = 0
    threshold: Annotated[
        float, Field(gt=0, description="Manipulability below which the task acts, m^3 (planar: m^2)")
    ] = 3e-5

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return one row: the manipulability of the tip's position."""
        check_members("manipulability", "fingers", (self.finger,), system.n_contacts)
        return PackedTask((self.finger,), (self.threshold,), 1)
