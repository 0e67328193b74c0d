"""How far apart grasps are."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.optimize import linear_sum_assignment

from graspbench.arrays import FloatArray


def contact_distance_m(first: FloatArray, second: FloatArray) -> float:
    """Return the mean distance of the contacts of two grasps, matched so that it is smallest.

    Args:
        first: Contact points, shape (n_f, 3), m.
        second: Those of the other grasp, same shape.
    """
    distances = np.linalg.norm(first[:, None] - second[None], axis=-1)
    return float(distances[linear_sum_assignment(distances)].mean())


def diversity_m(grasps: Sequence[FloatArray]) -> float | None:
    """Return the mean contact distance over all pairs of grasps; None for fewer than two.

    Args:
        grasps: Contact points of each, shape (n_f, 3), m.
    """
    if len(grasps) < 2:
        return None
    return float(np.mean([contact_distance_m(a, b) for a, b in combinations(grasps, 2)]))
