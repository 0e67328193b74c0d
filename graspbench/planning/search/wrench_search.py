"""Search for the best grasp by Q1, Q2 or Q3."""

from collections.abc import Callable, Sequence

import numpy as np

from graspbench.arrays import IntArray
from graspbench.grasp.configuration import Grasp
from graspbench.planning.search.climb import Climber, ContactsInTurn, Place, sampled_grasps
from graspbench.planning.search.engine import Progress, branch_and_bound
from graspbench.planning.search.enumeration import can_enumerate, enumerate_triples
from graspbench.planning.search.layout import Layout, lay_out
from graspbench.planning.search.objectives import CODES, Objective, make_objective
from graspbench.planning.search.problem import Found, GlobalResult, Problem
from graspbench.threads import threads_available


def search_wrenches(
    problem: Problem, starts: Sequence[Grasp], on_begin: Callable[[Progress], None] | None = None
) -> GlobalResult:
    """Search for Q1, Q2 or Q3, beginning with the best start and some climbs; tell how far it is."""
    surface, search, referee = problem.surface, problem.search, problem.referee
    layout = lay_out(
        surface.points, -surface.normals, surface.centroid, problem.quality, problem.torque_length_m,
        np.flatnonzero(problem.usable), problem.n_f, problem.limits,
    )  # fmt: skip
    objective = make_objective(layout, problem.measure)
    best = _best_start(starts, layout, objective)
    climber = Climber(layout, objective, referee, follow=True)
    begins = [best] if best is not None and search.climbs else []
    begins += [Place(leaves, -np.inf, None) for leaves in sampled_grasps(layout, objective, search.climbs)]
    for begin in begins:
        top = climber.climb(begin, ContactsInTurn(len(layout.nodes)), problem.out_of_time)
        if top.grasp is not None and (best is None or top.value > best.value):
            best = top
    held = {} if best is None else {best.leaves.tobytes(): best.grasp}

    def accept(leaves: IntArray, value: float) -> float:
        held[leaves.tobytes()] = referee.hold(layout.nodes[leaves])
        return -np.inf if held[leaves.tobytes()] is None else value

    start = Progress(-np.inf, None, np.inf) if best is None else Progress(best.value, best.leaves, np.inf)
    if on_begin is not None:
        on_begin(start)
    threads = search.threads or threads_available()
    if can_enumerate(layout, problem.measure):
        progress = enumerate_triples(
            layout, objective, CODES[problem.measure], accept,
            threads=threads, out_of_time=problem.out_of_time, start=start,
        )  # fmt: skip
    else:
        progress = branch_and_bound(
            layout, objective, problem.n_f, accept,
            gap=search.gap, threads=threads, out_of_time=problem.out_of_time, start=start,
        )  # fmt: skip
    grasp = None if progress.tuple is None else held[progress.tuple.tobytes()]

    def evaluate(nodes: IntArray) -> float:
        leaves = layout.leaf_of[nodes][None]
        return float(objective.evaluate(leaves, progress.best)[0])

    return problem.result(
        Found(grasp, progress.best, progress.upper_bound, progress.finished, progress.evaluated), evaluate
    )


def _best_start(starts: Sequence[Grasp], layout: Layout, objective: Objective) -> Place | None:
    """Return the best start that meets the constraints on nodes."""
    best: Place | None = None
    for start in starts:
        leaves = layout.leaves_of(start.vertices)
        if leaves is None or not layout.within_limits(leaves[None])[0]:
            continue
        value = float(objective.evaluate(leaves[None], -np.inf)[0])
        if value > (-np.inf if best is None else best.value):
            best = Place(leaves, value, start)
    return best
