"""Keep joints away from their limits."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.errors import ConfigurationError
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.task import TASKS, CompiledTask, PackedTask, check_members
from graspbench.manipulation.task_kernels import JOINT_LIMIT


@TASKS.register("joint_limit")
@dataclass(frozen=True, kw_only=True)
class JointLimit(CompiledTask):
    """Push a joint back once it is within the margin of a limit; every joint comes and goes on its own."""

    KIND: ClassVar[int] = JOINT_LIMIT
    SEPARATE_ROWS: ClassVar[bool] = True

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 20.0
    joints: Annotated[tuple[int, ...], Field(description="Joints to watch; all if empty")] = ()
    lower: Annotated[tuple[float, ...], Field(description="Lower limits, rad; the hand's if empty")] = ()
    upper: Annotated[tuple[float, ...], Field(description="Upper limits, rad; the hand's if empty")] = ()
    margin: Annotated[float, Field(gt=0, description="Where the task begins, before the limit, rad")] = 0.1

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return a row for every watched joint: the joint itself, away from the nearer limit."""
        tree = system.tree
        joints = self.joints or tuple(range(tree.n_joints))
        check_members("joint_limit", "joints", joints, tree.n_joints)
        lower = self.lower or tuple(tree.lower[list(joints)])
        upper = self.upper or tuple(tree.upper[list(joints)])
        if not len(lower) == len(upper) == len(joints):
            raise ConfigurationError(
                f"the task joint_limit watches {len(joints)} joints but has {len(lower)} lower and "
                f"{len(upper)} upper limits"
            )
        limits = np.column_stack([lower, upper]).ravel()
        return PackedTask((len(joints), *joints), (self.margin, *limits), len(joints))
