"""A first good grasp for the search to beat."""

from collections.abc import Callable

import numpy as np

from graspbench.arrays import IntArray
from graspbench.planning.search.layout import Layout
from graspbench.planning.search.objectives import Objective

SAMPLES = 8192
AT_ONCE = 8


def sampled_grasps(layout: Layout, objective: Objective, count: int) -> list[IntArray]:
    """Return the most promising of some random grasps, best first.

    Args:
        layout: The problem.
        objective: What is to be maximised.
        count: Number of grasps wanted, each force closure; fewer where fewer were found.

    Returns:
        Leaves of each, shape (n_f,).
    """
    samples = layout.sample(SAMPLES)
    order = np.argsort(-objective.promise(samples), kind="stable")
    found: list[IntArray] = []
    for start in range(0, len(order), AT_ONCE):
        if len(found) >= count:
            break
        part = samples[order[start : start + AT_ONCE]]
        found += list(part[objective.evaluate(part, -np.inf) > -np.inf])
    return found[:count]


def climb(
    layout: Layout,
    objective: Objective,
    accept: Callable[[IntArray, float], float],
    grasp: IntArray,
    value: float,
) -> tuple[IntArray, float]:
    """Move one contact after the other to its best place on the whole surface, until none gets better.

    Args:
        layout: The problem.
        objective: What is to be maximised.
        accept: Returns the value of a grasp that the hand can hold, else -inf.
        grasp: Leaves to start from, shape (n_f,).
        value: What the grasp is worth; -inf if it is not accepted.

    Returns:
        Leaves of the grasp at the end, and its value; -inf if no accepted one was met.
    """
    still, contact = 0, 0
    while still < len(grasp):
        moves = np.repeat(grasp[None], len(layout.nodes), axis=0)
        moves[:, contact] = np.arange(len(layout.nodes))
        better = _best_accepted(objective, moves[layout.within_limits(moves)], accept, value)
        still += 1
        if better is not None:
            (grasp, value), still = better, 0
        contact = (contact + 1) % len(grasp)
    return grasp, value


def _best_accepted(
    objective: Objective, moves: IntArray, accept: Callable[[IntArray, float], float], value: float
) -> tuple[IntArray, float] | None:
    """Return the best accepted one of many grasps, and its value, if it is better than ``value``."""
    promise = objective.promise(moves)
    order = np.argsort(-promise, kind="stable")
    for start in range(0, len(order), AT_ONCE):
        part = order[start : start + AT_ONCE]
        part = part[promise[part] > value * (1.0 + 1e-9)] if value > 0.0 else part
        if not len(part):
            return None
        values = objective.evaluate(moves[part], value)
        for k in np.argsort(-values, kind="stable"):
            if not values[k] > max(value * (1.0 + 1e-9), value):
                break
            if accept(moves[part[k]], float(values[k])) > value:
                return moves[part[k]], float(values[k])
    return None
