"""Hierarchical quadratic programs: the same tasks with limits as hard inequalities.

Where the projected velocity meets all limits it is the answer. Otherwise the object's motion, then
each task in its order, then the rest are brought as close to that velocity as the limits allow, each
level without loss to those above. So the two forms agree where no limit is active, and join there.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import IntArray
from graspbench.errors import ManipulationError
from graspbench.manipulation.compiled.limit_arrays import LimitArrays
from graspbench.manipulation.compiled.limits import limit_velocity
from graspbench.manipulation.compiled.step_records import LawArrays, TaskTable
from graspbench.manipulation.contact_kinematics import ManipulationSystem, State


@dataclass(frozen=True)
class DistanceLimit:
    """A least distance between the centres of two fingertips."""

    first: Annotated[int, Field(ge=0, description="One finger")]
    second: Annotated[int, Field(ge=0, description="The other finger")]
    minimum_m: Annotated[float, Field(gt=0, description="Least distance, m")]


@dataclass(frozen=True)
class QpParameters:
    """Hard limits of the hierarchical QP form: configuration group ``clik.qp``."""

    limit_gain: Annotated[
        float, Field(gt=0, description="Share of the way to a limit that may be gone in a second, 1/s")
    ] = 100.0
    distances: Annotated[
        tuple[DistanceLimit, ...], Field(description="Pairs of fingertips to keep apart")
    ] = ()
    distance_margin_m: Annotated[
        float, Field(ge=0, description="Added to a distance, for the curvature of a period's motion, m")
    ] = 1e-4


class HierarchicalQP:
    """Brings a law's velocity inside the limits, level after level.

    Args:
        system: The system; its tree has the joint limits.
        parameters: The limits.
        step_s: Control period; limits hold at its end if the velocity is held.

    Attributes:
        levels_solved: In the last call; 0 where the projected velocity met all limits.
    """

    def __init__(self, system: ManipulationSystem, parameters: QpParameters, step_s: float) -> None:
        tree, pairs = system.tree, parameters.distances
        self._system = system
        self._limits = LimitArrays(
            sizes=system.sizes,
            gain=min(parameters.limit_gain, 1.0 / step_s),
            margin_m=parameters.distance_margin_m,
            lower=tree.lower,
            upper=tree.upper,
            fastest=tree.velocity_limits,
            domains=[contact.chart.domain for contact in system.contacts],
            pairs=np.array([(pair.first, pair.second) for pair in pairs]).reshape(-1, 2),
            distances_m=[pair.minimum_m for pair in pairs],
        )
        self.levels_solved = 0

    def limit(self, state: State, law: LawArrays, table: TaskTable, order: IntArray) -> None:
        """Replace the law's velocity by the admissible one that comes closest to it, by priority.

        Raises:
            ManipulationError: No velocity is admissible.
        """
        blocks = self._system.arrays.block, state.block, law.block, table.block, self._limits.block
        self.levels_solved = limit_velocity(*blocks, order)
        if self.levels_solved < 0:
            raise ManipulationError(
                "the quadratic program of the object's motion has no solution",
                remedy="relax the limits or slow the motion",
                joints=state.joints.copy(),
            )
