"""Two experiments trial by trial: what changed, and whether that can be chance."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import stats

from graspbench.errors import LogError

DEFAULT_VALUES = (
    "success", "local.q1", "local.q2", "local.q3", "ratio.q1", "ratio.q2", "ratio.q3", "local.time_s",
)  # fmt: skip
_KEYS = ("object.", "hand.", "index.", "stations.", "seed")
_NOT_KEYS = ("object.mass_kg", "object.extents_m")


def compare_experiments(
    first: pd.DataFrame, second: pd.DataFrame, values: Sequence[str] = ()
) -> tuple[pd.DataFrame, list[str]]:
    """Compare two experiments by paired tests.

    Trials are paired by their id where the experiments share ids (another version of the code), else by
    object, hand, index, stations and seed, as far as these vary inside an experiment: what is constant
    inside each but differs between the two is the change that is tested. Trials of one experiment with the
    same key are averaged.

    Args:
        first: One row a trial, experiment A.
        second: Experiment B.
        values: Columns to compare; by default success, qualities, ratios and planning time.

    Returns:
        One row a value: pairs, mean of A and of B, mean difference B - A with its 95 % half width
        (Student's t), p of Wilcoxon's signed rank test (for success: McNemar's exact test), and p after
        Holm's correction for the number of values. Then the names of the columns the pairs were made by.

    Raises:
        LogError: No trial of A has a partner in B.
    """
    keys = _pairing(first, second)
    chosen = [name for name in (values or DEFAULT_VALUES) if name in first and name in second]
    a, b = (_means(table, keys, chosen) for table in (first, second))
    common = a.index.intersection(b.index)
    if not len(common) or not chosen:
        raise LogError(
            "no trial of the first experiment has a partner in the second",
            remedy="compare experiments over the same objects, hands and seeds",
        )
    records = [_compared(name, a.loc[common, name], b.loc[common, name]) for name in chosen]
    table = pd.DataFrame(records)
    table["p_holm"] = _holm(table["p"].to_numpy(dtype=np.float64))
    return table, keys


def _pairing(first: pd.DataFrame, second: pd.DataFrame) -> list[str]:
    if set(first["trial_id"]) & set(second["trial_id"]):
        return ["trial_id"]
    candidates = [
        str(name)
        for name in first.columns
        if name in second and str(name).startswith(_KEYS) and name not in _NOT_KEYS
    ]
    varying = [
        name
        for name in candidates
        if first[name].nunique(dropna=False) > 1 or second[name].nunique(dropna=False) > 1
    ]
    return varying or ["seed"]


def _means(table: pd.DataFrame, keys: Sequence[str], values: Sequence[str]) -> pd.DataFrame:
    numbers = pd.DataFrame({name: pd.to_numeric(table[name], errors="coerce") for name in values})
    numbers = numbers.astype(float)
    if "success" in numbers:  # a trial that was not finished has not succeeded
        numbers["success"] = numbers["success"].fillna(0.0)
    return numbers.groupby([table[key] for key in keys], dropna=False).mean()


def _compared(name: str, a: pd.Series, b: pd.Series) -> dict[str, object]:
    x, y = a.to_numpy(dtype=np.float64), b.to_numpy(dtype=np.float64)
    use = np.isfinite(x) & np.isfinite(y)
    x, y = x[use], y[use]
    difference, n = y - x, int(use.sum())
    half = float(stats.t.ppf(0.975, n - 1) * difference.std(ddof=1) / np.sqrt(n)) if n > 1 else np.nan
    binary = name == "success" and set(np.unique(np.concatenate((x, y)))) <= {0.0, 1.0}
    return {
        "value": name,
        "pairs": n,
        "A.mean": float(x.mean()) if n else np.nan,
        "B.mean": float(y.mean()) if n else np.nan,
        "difference": float(difference.mean()) if n else np.nan,
        "ci": half,
        "better": int((difference > 0).sum()),
        "worse": int((difference < 0).sum()),
        "test": "McNemar" if binary else "Wilcoxon",
        "p": _mcnemar(difference) if binary else _wilcoxon(difference),
    }


def _wilcoxon(difference: np.ndarray) -> float:
    """Return the two-sided p of the signed rank test; 1 when nothing differs."""
    moved = difference[difference != 0]
    return float(stats.wilcoxon(moved).pvalue) if len(moved) else 1.0


def _mcnemar(difference: np.ndarray) -> float:
    """Return the exact two-sided p: of the pairs that disagree, half should go either way."""
    gained, lost = int((difference > 0).sum()), int((difference < 0).sum())
    return float(stats.binomtest(gained, gained + lost).pvalue) if gained + lost else 1.0


def _holm(p: np.ndarray) -> np.ndarray:
    """Return p values corrected for their number (Holm 1979)."""
    order = np.argsort(p)
    steps = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1))
    corrected = np.empty_like(p)
    corrected[order] = np.minimum(steps, 1.0)
    return corrected
