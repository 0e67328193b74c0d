"""The certified global search against plain enumeration.

Both are run on a coarse network, where they must agree. There enumeration's rate is counted; from it follows
how long enumeration would take on the full network, which the search's time there is set beside. Both keep
the same constraints: the hand, and the centre of grip near the centroid. Times are processor times, all
threads together, without what the two have in common: images and reconstruction.
"""

from collections.abc import Sequence
from functools import partial
from math import comb
from pathlib import Path

import numpy as np

from graspbench.bench.enumeration import Limits, all_combinations, enumerate_best
from graspbench.bench.result import BenchResult
from graspbench.bench.timing import best_time
from graspbench.config.trial_config import TrialConfig, load_config
from graspbench.errors import ConfigurationError
from graspbench.hand import GraspChecker, load_hand
from graspbench.planning import GlobalResult, plan_global
from graspbench.planning.global_search import GLOBAL_MEASURES
from graspbench.reconstruction import Surface
from graspbench.trial.planned import reconstructed

OBJECTS = ("teddy",)
NODES = 1502
COARSE_NODES = {3: 120, 4: 40}
QUICK_NODES = {3: 30, 4: 14}

SHOWN = (
    "object", "contacts", "measure", "agreement", "search_s", "gap", "enumeration_s", "ratio",
)  # fmt: skip


def run(
    output_dir: Path | None = None, *, objects: Sequence[str] = OBJECTS, quick: bool = False
) -> BenchResult:
    """Measure Q1, Q2, Q3 and, with three contacts, Mirtich and Canny's criterion.

    Args:
        output_dir: Not used; there is no plot.
        objects: Names in the catalogue.
        quick: Take few nodes for both networks, to see whether it works.

    Raises:
        ConfigurationError: There is no such object.
        TrialError: An object cannot be seen or reconstructed.
    """
    if not objects:
        raise ConfigurationError("there is no object to measure", remedy="name one, such as teddy")
    rows: list[dict[str, object]] = []
    for name in objects:
        for n_f, coarse_nodes in (QUICK_NODES if quick else COARSE_NODES).items():
            config = load_config([f"object={name}", f"hand.fingers={n_f}", f"surface.nodes={coarse_nodes}"])
            full_config = load_config([f"object={name}", f"hand.fingers={n_f}", f"surface.nodes={NODES}"])
            coarse = reconstructed(config)[-1]
            full = coarse if quick else reconstructed(full_config)[-1]
            for measure in GLOBAL_MEASURES[: 4 if n_f == 3 else 3]:
                rows.append(_row(config, measure, coarse, full))
    return BenchResult("global", tuple(rows), shown=SHOWN)


def _row(config: TrialConfig, measure: str, coarse: Surface, full: Surface) -> dict[str, object]:
    n_f = config.hand.fingers
    grasps = all_combinations(len(coarse.points), n_f)
    limits = _limits(config, coarse)
    enumerate_all = partial(enumerate_best, coarse, grasps, measure, config.quality, limits)
    enumerate_best(coarse, grasps[:1], measure, config.quality, limits)  # compiled, when it is
    peer_s, peer_value = best_time(enumerate_all, 1)
    same = _search(config, measure, coarse)
    search_s, found = best_time(partial(_search, config, measure, full), 1)
    total = comb(len(full.points), n_f)
    enumeration_s = total / (len(grasps) / peer_s)
    return {
        "object": config.object.name,
        "contacts": n_f,
        "measure": measure,
        "coarse_nodes": len(coarse.points),
        "coarse_grasps": len(grasps),
        "coarse_enumeration_s": peer_s,
        "coarse_search_s": same.time_s,
        "coarse_value": same.value,
        "coarse_enumeration_value": peer_value,
        "agreement": bool(np.isclose(same.value, peer_value, rtol=1e-9, atol=0.0)),
        "nodes": len(full.points),
        "grasps": total,
        "search_s": search_s,
        "search_wall_s": found.time_s,
        "value": found.value,
        "upper_bound": found.upper_bound,
        "gap": found.gap,
        "optimal": found.optimal,
        "optimal_up_to_solver": found.optimal_up_to_solver,
        "enumeration_rate_per_s": len(grasps) / peer_s,
        "enumeration_s": enumeration_s,
        "ratio": enumeration_s / search_s,
    }


def _search(config: TrialConfig, measure: str, surface: Surface) -> GlobalResult:
    limits = _limits(config, surface)
    return plan_global(
        surface, measure, config.hand.fingers, config.quality, config.search,
        checker=limits.checker, centre_tolerance_m=limits.centre_tolerance_m,
    )  # fmt: skip


def _limits(config: TrialConfig, surface: Surface) -> Limits:
    search = config.search
    checker = GraspChecker(load_hand(config.hand), 0.0 if config.surface.ground else None)
    checker.set_object(surface.points, surface.network.faces)
    return Limits(checker, search.centre_tolerance_m, *search.thresholds_deg)
