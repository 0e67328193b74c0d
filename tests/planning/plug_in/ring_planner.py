"""A planner of another distribution: contacts evenly around the object at one height, in several turns."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.planning import AnyPlannerParameters, FoundGrasp, PlanningProblem, placed_grasp


@dataclass(frozen=True)
class RingParameters(AnyPlannerParameters):
    """Where the ring is."""

    turns: Annotated[int, Field(ge=1, description="Turns of the ring to try")] = 12
    above_m: Annotated[float, Field(description="Height of the ring over the centroid, m")] = 0.0


class Ring:
    """Yields what the hand holds, the widest ring best."""

    parameters: ClassVar[type[AnyPlannerParameters]] = RingParameters
    climbs_index: ClassVar[bool] = False

    def __init__(self, parameters: RingParameters) -> None:
        self._parameters = parameters

    def plan(self, problem: PlanningProblem) -> Iterator[FoundGrasp]:
        surface = problem.finished_surface()
        arms = surface.points - surface.centroid
        for turn in np.linspace(0.0, 2 * np.pi / problem.n_f, self._parameters.turns, endpoint=False):
            if problem.time_left_s() <= 0.0:
                return
            angles = turn + 2 * np.pi * np.arange(problem.n_f) / problem.n_f
            wanted = 0.03 * np.column_stack((np.cos(angles), np.sin(angles), np.zeros(problem.n_f)))
            wanted[:, 2] = self._parameters.above_m
            vertices = np.argmin(np.linalg.norm(arms[None] - wanted[:, None], axis=2), axis=1)
            if len(set(vertices.tolist())) < problem.n_f:
                continue
            grasp = placed_grasp(problem, surface, vertices)
            if grasp is not None:
                yield FoundGrasp(grasp, float(np.linalg.norm(arms[vertices][:, :2], axis=1).mean()))
