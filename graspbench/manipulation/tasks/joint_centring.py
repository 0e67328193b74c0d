"""Draw joints towards a posture."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.errors import ConfigurationError
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.task import TASKS, CompiledTask, PackedTask
from graspbench.manipulation.task_kernels import JOINT_CENTRING


@TASKS.register("joint_centring")
@dataclass(frozen=True, kw_only=True)
class JointCentring(CompiledTask):
    """Draw joints towards the middle of their ranges, or a given posture, as far as all else allows."""

    KIND: ClassVar[int] = JOINT_CENTRING

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 1.0
    posture: Annotated[tuple[float, ...], Field(description="Wanted joints, rad; mid-range if empty")] = ()

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return a row for every joint."""
        posture = self.posture or tuple(system.tree.mid_range)
        if len(posture) != system.n_joints:
            raise ConfigurationError(
                f"the posture of the task joint_centring has {len(posture)} joints but the hand "
                f"{system.n_joints}"
            )
        return PackedTask((), posture, system.n_joints)
