"""Best-first branch and bound: the most promising clusters are split until single grasps are left."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.planning.search.frontier import expand, push
from graspbench.planning.search.layout import Layout
from graspbench.planning.search.objectives import Objective

BATCH = 512
LEAF_BATCH, LEAF_CHUNK = 64, 8
CAPACITY_LIMIT = 12_000_000
"""Tuples that the frontier may hold; beyond, the search stops with an honest gap."""

EVALUATED_AT_ONCE = 16


@dataclass
class Progress:
    """How far a search is.

    Attributes:
        best: Best accepted value.
        tuple: Its leaves, shape (n_f,); None while there is none.
        upper_bound: No grasp, accepted or not seen yet, is better.
        evaluated: Grasps whose measure was computed.
        finished: Whether nothing is left that could be better.
    """

    best: float
    tuple: IntArray | None
    upper_bound: float
    evaluated: int = 0
    finished: bool = False


def branch_and_bound(
    layout: Layout,
    objective: Objective,
    n_f: int,
    accept: Callable[[IntArray, float], float],
    *,
    gap: float,
    threads: int,
    out_of_time: Callable[[], bool],
    start: Progress,
) -> Progress:
    """Search all grasps of n_f different nodes.

    Args:
        layout: The problem.
        objective: What to maximise.
        n_f: Number of contacts.
        accept: Called with the leaves and value of each grasp that is better than all accepted ones;
            returns its exact value, or -inf if it is to be refused.
        gap: Stop when (upper bound - best) / upper bound is at most this.
        threads: Threads that bound tuples; the result does not depend on it.
        out_of_time: Asked between batches.
        start: Where to begin: a known best value, or -inf.
    """
    progress = start
    bounds = np.empty(1 << 15)
    tuples = np.zeros((1 << 15, n_f), dtype=np.int64)
    root, root_bound = np.zeros((1, n_f), dtype=np.int64), np.array([np.inf])
    objective.bound(root, root_bound, progress.best)
    size = push(bounds, tuples, 0, root_bound, root, progress.best)
    radii = np.ascontiguousarray(layout.balls[:, 3])
    children, child_bounds = np.zeros((BATCH, n_f), dtype=np.int64), np.empty(BATCH)
    leaves = np.zeros((LEAF_BATCH, n_f), dtype=np.int64)
    with ThreadPoolExecutor(threads) as pool:
        while True:
            if size == 0 or bounds[0] <= progress.best:
                progress.upper_bound, progress.finished = progress.best, True
                return progress
            progress.upper_bound = float(bounds[0])
            if progress.upper_bound - progress.best <= gap * progress.upper_bound:
                progress.finished = gap == 0.0
                return progress
            if out_of_time() or size > CAPACITY_LIMIT:
                return progress
            if size + BATCH > len(bounds):
                bounds = np.concatenate([bounds, np.empty_like(bounds)])
                tuples = np.concatenate([tuples, np.zeros_like(tuples)])
            size, n_children, n_leaves = expand(
                bounds, tuples, size, layout.branches, radii, objective.few,
                children, child_bounds, leaves, progress.best,
            )  # fmt: skip
            if n_children:
                _bound(
                    objective, children[:n_children], child_bounds[:n_children], progress.best, pool, threads
                )
                size = push(
                    bounds, tuples, size, child_bounds[:n_children], children[:n_children], progress.best
                )
            if n_leaves and not _resolve(objective, leaves[:n_leaves], accept, progress, pool, out_of_time):
                return progress


def _bound(
    objective: Objective,
    tuples: IntArray,
    bounds: FloatArray,
    lower: float,
    pool: ThreadPoolExecutor,
    threads: int,
) -> None:
    if threads == 1 or len(tuples) < 4 * threads:
        objective.bound(tuples, bounds, lower)
        return
    cuts = np.linspace(0, len(tuples), threads + 1).astype(int)
    jobs = [pool.submit(objective.bound, tuples[a:b], bounds[a:b], lower) for a, b in pairwise(cuts)]
    for job in jobs:
        job.result()


def _resolve(
    objective: Objective,
    tuples: IntArray,
    accept: Callable[[IntArray, float], float],
    progress: Progress,
    pool: ThreadPoolExecutor,
    out_of_time: Callable[[], bool],
) -> bool:
    """Find the best grasp of tuples that hold few; return False if the time was up before."""
    lower = progress.best
    chunks = [tuples[k : k + LEAF_CHUNK] for k in range(0, len(tuples), LEAF_CHUNK)]
    found = list(pool.map(lambda chunk: objective.candidates(chunk, lower), chunks))
    grasps = np.concatenate([part[0] for part in found])
    bounds = np.concatenate([part[1] for part in found])
    order = np.argsort(-bounds, kind="stable")
    for start in range(0, len(order), EVALUATED_AT_ONCE):
        part = order[start : start + EVALUATED_AT_ONCE]
        if bounds[part[0]] <= progress.best:
            break
        if out_of_time():
            return False
        values = objective.evaluate(grasps[part], progress.best)
        progress.evaluated += len(part)
        for k in np.argsort(-values, kind="stable"):
            if not values[k] > progress.best:
                break
            value = accept(grasps[part[k]], float(values[k]))
            if value > progress.best:
                progress.best, progress.tuple = value, grasps[part[k]].copy()
    return True
