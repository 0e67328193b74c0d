"""Search of all triples of nodes, the best first: see `graspbench.planning.search.triples`."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.planning.search.bounds import Q1, Q2, Q3
from graspbench.planning.search.engine import Progress
from graspbench.planning.search.layout import Layout
from graspbench.planning.search.objectives import Objective
from graspbench.planning.search.triples import list_triples, pair_cosines

LARGEST = {Q1: 1.5**0.5, Q2: 1.5, Q3: 0.5}
"""Largest values that three frictionless contacts can have, forces in the plane alone."""

AT_ONCE = 8
"""First nodes whose triples are listed together."""

EVALUATED_AT_ONCE = 64
ROOM, MAX_LISTED = 1 << 14, 1 << 21
"""Triples of `AT_ONCE` first nodes that there is room for at first, and triples that are kept in all."""


def can_enumerate(layout: Layout, measure: str) -> bool:
    """Tell whether a problem is one of triples: three frictionless contacts, forces in the plane alone."""
    quality = layout.quality
    frictionless = quality.contact == "frictionless" and quality.wrench_space == "planar_force"
    return layout.n_f == 3 and frictionless and not (measure == "q3" and quality.norm == "linf")


def enumerate_triples(
    layout: Layout,
    objective: Objective,
    measure: int,
    accept: Callable[[IntArray, float], float],
    *,
    threads: int,
    out_of_time: Callable[[], bool],
    start: Progress,
) -> Progress:
    """Search all triples of different nodes; takes and gives what `branch_and_bound` does.

    Args:
        layout: The problem; see `can_enumerate`.
        objective: What to maximise.
        measure: Its code: Q1, Q2 or Q3.
        accept: Called with the leaves and value of each grasp that is better than all accepted ones;
            returns its exact value, or -inf if it is to be refused.
        threads: Threads that list triples; the result does not depend on it.
        out_of_time: Asked between batches.
        start: Where to begin: a known best value, or -inf.
    """
    progress, ceiling = start, np.inf
    progress.upper_bound = LARGEST[measure] * (1.0 + 1e-9)
    with ThreadPoolExecutor(threads) as pool:
        while True:
            listed = _list(layout, measure, max(progress.best, 0.0), ceiling, pool, threads, out_of_time)
            if listed is None:
                return progress
            triples, values, left_out = listed
            if not _try(objective, triples, values, accept, progress, out_of_time):
                return progress
            if left_out <= progress.best:
                progress.upper_bound, progress.finished = progress.best, True
                return progress
            progress.upper_bound = ceiling = left_out


def _list(
    layout: Layout,
    measure: int,
    floor: float,
    ceiling: float,
    pool: ThreadPoolExecutor,
    threads: int,
    out_of_time: Callable[[], bool],
) -> tuple[IntArray, FloatArray, float] | None:
    """Return the best triples in a range of values, best first; None if the time was up.

    Returns:
        Leaves, upper bounds of the values, and the value that no triple left out exceeds.
    """
    parts: list[tuple[IntArray, FloatArray]] = []
    firsts = range(0, len(layout.nodes), AT_ONCE)
    compatible = _compatible(layout, measure, floor)
    kept, left_out = 0, floor
    for batch in range(0, len(firsts), 4 * threads):
        if out_of_time():
            return None
        some = firsts[batch : batch + 4 * threads]
        parts += pool.map(partial(_from, layout, measure, compatible, left_out, ceiling), some)
        kept = sum(len(values) for _, values in parts)
        if kept > MAX_LISTED:
            so_far = np.concatenate([values for _, values in parts])
            left_out = float(np.partition(so_far, kept // 2)[kept // 2])
            parts = [(triples[values > left_out], values[values > left_out]) for triples, values in parts]
    triples = np.concatenate([triples for triples, _ in parts])
    values = np.concatenate([values for _, values in parts])
    allowed = layout.within_limits(triples)
    triples, values = triples[allowed], values[allowed]
    order = np.argsort(-values, kind="stable")
    return triples[order], values[order], left_out


def _from(
    layout: Layout, measure: int, compatible: BoolArray, floor: float, ceiling: float, first: int
) -> tuple[IntArray, FloatArray]:
    """Return the triples of some first nodes, and upper bounds of their values."""
    room = ROOM
    while True:
        triples, values = np.empty((room, 3), dtype=np.int64), np.empty(room)
        found = list_triples(
            layout.points, layout.normals_in, compatible, measure, layout.centroid,
            float(layout.limits[1]) * (1.0 + 1e-9), floor, ceiling, first,
            min(first + AT_ONCE, len(layout.nodes)), triples, values,
        )  # fmt: skip
        if found <= room:
            return triples[:found].copy(), values[:found].copy()
        room = found


def _compatible(layout: Layout, measure: int, floor: float) -> BoolArray:
    """Tell which pairs of nodes can be in a grasp that is better than ``floor``, shape (n, n)."""
    low, high = pair_cosines(measure, floor)
    cosines = layout.normals_in @ layout.normals_in.T
    gaps = np.linalg.norm(layout.points[:, None] - layout.points[None], axis=-1)
    rounding = 1e-9
    near = gaps <= layout.limits[0] * (1.0 + rounding)
    return np.asarray(near & (cosines >= low - rounding) & (cosines <= high + rounding))


def _try(
    objective: Objective,
    triples: IntArray,
    values: FloatArray,
    accept: Callable[[IntArray, float], float],
    progress: Progress,
    out_of_time: Callable[[], bool],
) -> bool:
    """Ask about the best of some triples, best first; return False if the time was up before."""
    for begin in range(0, len(triples), EVALUATED_AT_ONCE):
        if values[begin] <= progress.best:
            break
        progress.upper_bound = float(values[begin])
        if out_of_time():
            return False
        part = triples[begin : begin + EVALUATED_AT_ONCE]
        exact = objective.evaluate(part, progress.best)
        progress.evaluated += len(part)
        for k in np.argsort(-exact, kind="stable"):
            if not exact[k] > progress.best:
                break
            value = accept(part[k], float(exact[k]))
            if value > progress.best:
                progress.best, progress.tuple = value, part[k].copy()
    return True
