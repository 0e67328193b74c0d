"""Statistics over trials: means with intervals, success rates, rank correlations."""

import difflib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError

STATISTICS = ("mean", "std", "ci", "median", "min", "max", "count")


@dataclass(frozen=True)
class Interval:
    """An estimate with its confidence interval.

    Attributes:
        value: The estimate.
        low: Lower end.
        high: Upper end.
        count: Number of observations.
        p: Two-sided p value of there being no effect; nan where none is tested.
    """

    value: float
    low: float
    high: float
    count: int
    p: float = np.nan


def wilson_interval(successes: int, trials: int, confidence: float = 0.95) -> Interval:
    """Return a success rate with Wilson's score interval (Wilson 1927).

    Args:
        successes: Number of successes, 0 to ``trials``.
        trials: Number of trials; with none the interval is [0, 1] and the value nan.
        confidence: Coverage asked for.
    """
    if trials == 0:
        return Interval(np.nan, 0.0, 1.0, 0)
    z = float(stats.norm.ppf(0.5 + confidence / 2))
    rate = successes / trials
    centre = (rate + z * z / (2 * trials)) / (1 + z * z / trials)
    half = z / (1 + z * z / trials) * np.sqrt(rate * (1 - rate) / trials + z * z / (4 * trials**2))
    low = 0.0 if successes == 0 else max(0.0, centre - half)
    high = 1.0 if successes == trials else min(1.0, centre + half)
    return Interval(rate, float(low), float(high), trials)


def bootstrap_mean(
    values: FloatArray, clusters: Sequence[object], confidence: float = 0.95, resamples: int = 1000
) -> Interval:
    """Return a mean with its percentile interval over resampled clusters (Efron 1979), from a fixed seed.

    Values that are not finite are left out. With one cluster alone its values are resampled; of a single
    value there is no interval.

    Args:
        values: Shape (n,).
        clusters: What values belong together, an object say, n of them.
        confidence: Coverage asked for.
        resamples: How often to draw.
    """
    use = np.isfinite(values)
    known = values[use]
    if len(known) == 0:
        return Interval(np.nan, np.nan, np.nan, 0)
    _, which = np.unique(np.array([str(each) for each in clusters])[use], return_inverse=True)
    if which.max() == 0:
        which = np.arange(len(known))
    count = int(which.max()) + 1
    if count == 1:
        return Interval(float(known.mean()), np.nan, np.nan, len(known))
    sums, sizes = np.bincount(which, known), np.bincount(which).astype(np.float64)
    drawn = np.random.default_rng(0).integers(count, size=(resamples, count))
    means = sums[drawn].sum(axis=1) / sizes[drawn].sum(axis=1)
    low, high = np.quantile(means, [(1.0 - confidence) / 2, (1.0 + confidence) / 2])
    return Interval(float(known.mean()), float(low), float(high), len(known))


def spearman(x: FloatArray, y: FloatArray, confidence: float = 0.95) -> Interval:
    """Return Spearman's rank correlation with an interval by Fisher's z (Bonett and Wright 2000).

    Pairs with a value that is not finite are left out. With fewer than four pairs, or when one side
    is constant, nothing is estimated: the value is nan and the interval [-1, 1].

    Args:
        x: Shape (n,).
        y: Shape (n,).
        confidence: Coverage asked for.
    """
    use = np.isfinite(x) & np.isfinite(y)
    a, b = x[use], y[use]
    n = len(a)
    if n < 4 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return Interval(np.nan, -1.0, 1.0, n)
    rho = float(np.corrcoef(stats.rankdata(a), stats.rankdata(b))[0, 1])
    widest = 1.0 - 12.0 / (n * (n * n - 1))  # two neighbours swapped: a perfect order has no interval
    clipped = float(np.clip(rho, -widest, widest))
    half = float(stats.norm.ppf(0.5 + confidence / 2)) * np.sqrt((1 + clipped**2 / 2) / (n - 3))
    low, high = np.tanh(np.arctanh(clipped) + np.array([-half, half]))
    p = float(stats.spearmanr(a, b).pvalue)
    return Interval(rho, min(rho, float(low)), max(rho, float(high)), n, p)


def corrected(p: FloatArray) -> FloatArray:
    """Return p values corrected for their number (Benjamini and Hochberg 1995): a share of false finds.

    Args:
        p: Shape (n,); nan stays nan and does not count.
    """
    result = np.full(len(p), np.nan)
    tested = np.isfinite(p)
    if tested.any():
        result[tested] = stats.false_discovery_control(p[tested])
    return result


def check_statistics(names: Sequence[str]) -> None:
    """Refuse unknown statistics.

    Raises:
        ConfigurationError: A statistic is unknown.
    """
    for name in names:
        if name not in STATISTICS:
            close = difflib.get_close_matches(name, STATISTICS, n=1)
            hint = f"did you mean {close[0]}? " if close else ""
            raise ConfigurationError(
                f"unknown statistic '{name}'", remedy=f"{hint}choose from {', '.join(STATISTICS)}"
            )


def aggregate(
    trials: pd.DataFrame, group: Sequence[str], values: Sequence[str], statistic: Sequence[str]
) -> pd.DataFrame:
    """Summarise columns over groups of trials.

    Args:
        trials: One row a trial.
        group: Columns that make a group; "object" stands for "object.name", and so on.
        values: Columns to summarise; missing values are left out.
        statistic: Any of mean, std, ci (95 % half width by Student's t), median, min, max, count.

    Returns:
        One row a group, columns ``<value>.<statistic>``.

    Raises:
        ConfigurationError: A column or a statistic is unknown.
    """
    keys = [find_column(trials, name) for name in group]
    columns = [find_column(trials, name) for name in values]
    check_statistics(statistic)
    records = []
    for key, rows in trials.groupby(keys, dropna=False, sort=True):
        record: dict[str, object] = dict(zip(keys, key if isinstance(key, tuple) else (key,), strict=True))
        record["trials"] = len(rows)
        for column in columns:
            sample = pd.to_numeric(rows[column], errors="coerce").dropna().to_numpy(dtype=np.float64)
            record |= {f"{column}.{name}": _statistic(sample, name) for name in statistic}
        records.append(record)
    return pd.DataFrame(records)


def find_column(trials: pd.DataFrame, name: str) -> str:
    """Return the column of that name, or the only one that ends with it: "k_cm" is "index.k_cm".

    Raises:
        ConfigurationError: There is none, or there are several.
    """
    columns = [str(column) for column in trials.columns]
    for candidate in (name, f"{name}.name"):
        if candidate in columns:
            return candidate
    ending = [column for column in columns if column.endswith(f".{name}")]
    if len(ending) == 1:
        return ending[0]
    close = ending or difflib.get_close_matches(name, columns, n=5, cutoff=0.4)
    raise ConfigurationError(
        f"the trials have no column '{name}'",
        remedy=f"choose from {', '.join(close)}" if close else "look at the head of trials.csv",
    )


def _statistic(sample: FloatArray, name: str) -> float:
    n = len(sample)
    if name == "count":
        return float(n)
    if n == 0 or (name in ("std", "ci") and n < 2):
        return np.nan
    if name == "ci":
        return float(stats.t.ppf(0.975, n - 1) * sample.std(ddof=1) / np.sqrt(n))
    if name == "std":
        return float(sample.std(ddof=1))
    if name == "median":
        return float(np.median(sample))
    if name == "mean":
        return float(sample.mean())
    return float(sample.min() if name == "min" else sample.max())
