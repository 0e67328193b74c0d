"""Outcomes of protocols, and how they agree: success by protocol, and ranks between protocols."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy import stats

from graspbench.arrays import FloatArray

_RESAMPLES = 1000


def bootstrap_interval(values: FloatArray, seed: int = 0, confidence: float = 0.95) -> tuple[float, float]:
    """Return the interval of a mean by the bootstrap's percentiles (Efron 1979), values of shape (n,).

    Args:
        values: The sample; fewer than two give (nan, nan).
        seed: Source of the resampling.
        confidence: Coverage asked for.
    """
    if len(values) < 2:
        return float("nan"), float("nan")
    drawn = np.random.default_rng(seed).integers(0, len(values), (_RESAMPLES, len(values)))
    tail = 50.0 * (1.0 - confidence)
    low, high = np.percentile(values[drawn].mean(axis=1), [tail, 100.0 - tail])
    return float(low), float(high)


def kendall_between(values: Mapping[str, FloatArray]) -> list[dict[str, Any]]:
    """Return Kendall's tau-b between each two columns of values of the same grasps, in rows.

    Args:
        values: A column a protocol, shape (n,) each; nan where there is none.
    """
    names = list(values)
    rows: list[dict[str, Any]] = []
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            both = np.isfinite(values[first]) & np.isfinite(values[second])
            a, b = values[first][both], values[second][both]
            tau, p = float("nan"), float("nan")
            if len(a) >= 3 and np.ptp(a) > 0.0 and np.ptp(b) > 0.0:
                found = stats.kendalltau(a, b)
                tau, p = float(found.statistic), float(found.pvalue)
            rows.append(
                {"first": first, "second": second, "tau": tau, "p": p, "grasps": len(a)} | inversions(a, b)
            )
    return rows


def inversions(a: Sequence[float] | FloatArray, b: Sequence[float] | FloatArray) -> dict[str, int]:
    """Return how many pairs two columns order oppositely, and how many both order at all."""
    x, y = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    upper = np.triu_indices(len(x), 1)
    signs = np.sign(x[:, None] - x)[upper] * np.sign(y[:, None] - y)[upper]
    return {"inversions": int(np.sum(signs < 0.0)), "pairs": int(np.sum(signs != 0.0))}
