"""Local planning of an index by itself, no hand in the loop (thesis appendix A).

Every first equilateral grasp is moved twice: with the surface while it shrinks, and over the finished
surface alone. The two ways end in different local optima; the best by the index is kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from graspbench.arrays import IntArray
from graspbench.errors import PlanningError
from graspbench.grasp.configuration import Grasp
from graspbench.planning.barrier import FreeMoves
from graspbench.planning.index import Index
from graspbench.planning.initial import InitialGrasp, initial_grasps
from graspbench.planning.parameters import PlannerParameters
from graspbench.planning.settling import Follower, Settler, settle
from graspbench.reconstruction.surface import Surface


@dataclass(frozen=True)
class FreePlan:
    """A local optimum of an index.

    Attributes:
        grasp: The contacts; without a posture.
        history: The configurations on the way, first to last.
        score: What the index thinks of it; the index's own unit.
        starts: First grasps that were followed.
        moves: Moves of the kept grasp.
        time_s: Time of all.
    """

    grasp: Grasp
    history: tuple[Grasp, ...]
    score: float
    starts: int
    moves: int
    time_s: float


def plan_without_hand(
    surfaces: Sequence[Surface], index: Index, n_f: int, planner: PlannerParameters
) -> FreePlan:
    """Climb an index from every first grasp and keep the best local optimum.

    Args:
        surfaces: Snapshots of the reconstruction, an ellipsoid first, one at rest last.
        index: What the fingers climb.
        n_f: Number of contacts.
        planner: How many first grasps, and when to stop.

    Raises:
        PlanningError: The surface has too few nodes.
    """
    started = perf_counter()
    starts = [grasp for plane in initial_grasps(surfaces[0], n_f, planner.rotations) for grasp in plane]
    if not starts:
        raise PlanningError(f"the surface has too few nodes for {n_f} contacts", remedy="raise surface.nodes")
    routes = [_follow(surfaces, index, start, planner) for start in starts]
    routes += [_follow((surfaces[0], surfaces[-1]), index, start, planner) for start in starts]
    final = surfaces[-1]
    scores = [index.score(final, route[-1].vertices) for route in routes]
    best = int(np.argmax(scores))
    return FreePlan(
        grasp=routes[best][-1],
        history=tuple(routes[best]),
        score=scores[best],
        starts=len(starts),
        moves=len(routes[best]) - 1,
        time_s=perf_counter() - started,
    )


def _follow(
    surfaces: Sequence[Surface], index: Index, start: InitialGrasp, planner: PlannerParameters
) -> list[Grasp]:
    """Move one grasp on every surface after the first until no finger wants to move."""
    follower = Follower(start.vertices, via=[(surfaces[0], start.vertices)])
    settler = Settler(index, FreeMoves(), None, planner.max_moves, planner.wrist_moves)
    for surface in surfaces[1:]:
        settle(follower, surface, settler)
    return [_grasp(surface, vertices) for surface, vertices in follower.via]


def _grasp(surface: Surface, vertices: IntArray) -> Grasp:
    return Grasp(vertices, surface.points[vertices], surface.normals[vertices], surface.centroid)
