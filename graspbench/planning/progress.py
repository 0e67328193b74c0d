"""How far the planner has come at every step of the surface: it can be stopped at any of them."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.reconstruction.surface import Surface


@dataclass(frozen=True)
class PlanningStep:
    """The best grasp after one step of the surface.

    Attributes:
        iteration: The reconstruction's iteration.
        vertices: The best grasp so far, shape (n_f,).
        score: What the index thinks of it on this surface.
        followers: Grasps that follow the surface after this step.
        points: The surface's nodes, for how far it is from the finished one, shape (n_s, 3).
    """

    iteration: int
    vertices: IntArray
    score: float
    followers: int
    points: FloatArray


def step_of(surface: Surface, vertices: IntArray, score: float, followers: int) -> PlanningStep:
    """Return what is to be remembered of a step."""
    return PlanningStep(surface.iteration, vertices, score, followers, surface.points)


def formed_shares(steps: list[PlanningStep]) -> FloatArray:
    """Return how much of the way to the finished surface the nodes have gone at each step, shape (n,).

    The mean distance of the nodes to where they come to rest, 0 for the first surface and 1 for the last.
    """
    last = steps[-1].points
    left = np.array([np.linalg.norm(step.points - last, axis=1).mean() for step in steps])
    shares: FloatArray = 1.0 - left / left[0] if left[0] > 0.0 else np.ones(len(steps))
    return shares
