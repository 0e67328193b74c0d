"""Two experiments trial by trial: what changed, and whether that can be chance."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import stats

from graspbench.arrays import FloatArray
from graspbench.errors import LogError
from graspbench.report import columns as c
from graspbench.report.heads import head_of
from graspbench.report.notes import version_notes
from graspbench.report.statistics import corrected
from graspbench.report.tables import SIGNIFICANT, Column, Table

_COLUMNS = (
    Column("head", "value"),
    Column("pairs", "pairs", format="d"),
    Column("A.mean", "A", format=SIGNIFICANT),
    Column("B.mean", "B", format=SIGNIFICANT),
    Column("difference", "B - A", format=SIGNIFICANT, spread="ci"),
    Column("higher", "B higher", format="d"),
    Column("lower", "B lower", format="d"),
    Column("test", "test"),
    Column("p", "p", format=".2g"),
    Column("p_corrected", "p, corrected", format=".2g"),
)


def compare_experiments(
    first: pd.DataFrame,
    second: pd.DataFrame,
    values: Sequence[str] = (),
    names: tuple[str, str] = ("A", "B"),
) -> Table:
    """Compare two experiments by paired tests.

    Trials are paired by their id where the experiments share ids (another version of the code), else by
    every setting that varies inside an experiment: what is constant inside each but differs between the
    two is the change that is tested. Trials of one experiment with the same settings are averaged, which
    the notes count. Trials of which a value is empty are left out of its test.

    Args:
        first: One row a trial, experiment A.
        second: Experiment B.
        values: Columns to compare; by default success, qualities, ratios and planning time.
        names: What the experiments are called.

    Returns:
        One row a value: pairs, mean of A and of B, mean difference B - A with its 95 % half width
        (Student's t), p of Wilcoxon's signed rank test (for success: McNemar's exact test), and p after
        Benjamini and Hochberg's correction for the number of values.

    Raises:
        LogError: No trial of A has a partner in B, or no value is known in both.
    """
    keys = _pairing(first, second)
    chosen = [
        name
        for name in (values or c.COMPARED)
        if all(c.numbers(table, name).notna().any() for table in (first, second))
    ]
    if not chosen:
        wanted = " or ".join(values or c.COMPARED)
        raise LogError(
            f"the two experiments have no value of {wanted} in common",
            remedy="choose --value from columns that trials of both have; success needs an execution",
        )
    a, b = (_means(table, keys, chosen) for table in (first, second))
    common = a.index.intersection(b.index)
    if not len(common):
        raise LogError(
            "no trial of the first experiment has a partner in the second",
            remedy="compare experiments over the same objects, hands and seeds",
        )
    rows = [_compared(name, a.loc[common, name], b.loc[common, name]) for name in chosen]
    p = corrected(np.array([row["p"] for row in rows], dtype=np.float64))
    rows = [{**row, "p_corrected": float(value)} for row, value in zip(rows, p, strict=True)]
    notes = [
        f"Paired by {', '.join(keys)}; difference ± 95 % interval; p corrected for {len(rows)} values by "
        "Benjamini and Hochberg.",
        *_change_notes(first, second, keys),
        *_duplicate_notes(first, keys, "A"),
        *_duplicate_notes(second, keys, "B"),
        *_partner_notes(len(common), len(a), len(b)),
        *_empty_notes(rows, len(common)),
        *version_notes(pd.concat([first, second], ignore_index=True)),
    ]
    return Table("compare", f"A {names[0]} against B {names[1]}", _COLUMNS, tuple(rows), tuple(notes))


def _pairing(first: pd.DataFrame, second: pd.DataFrame) -> list[str]:
    if set(first[c.TRIAL_ID]) & set(second[c.TRIAL_ID]):
        return [c.TRIAL_ID]
    both = pd.concat([first, second], ignore_index=True)
    inside = {name for table in (first, second) for name in c.differing(table)}
    varying = [name for name in c.differing(both) if name in inside and name in first and name in second]
    return [name for name in varying if c.is_problem(name) or _shared(first, second, name)] or [c.SEED]


def _shared(first: pd.DataFrame, second: pd.DataFrame, name: str) -> bool:
    """Tell whether the experiments have a value of a setting in common: without, it is what is tested."""
    return bool(set(first[name].map(str)) & set(second[name].map(str)))


def _means(table: pd.DataFrame, keys: Sequence[str], values: Sequence[str]) -> pd.DataFrame:
    numbers = pd.DataFrame({name: c.numbers(table, name) for name in values})
    return numbers.groupby([table[key] for key in keys], dropna=False).mean()


def _change_notes(first: pd.DataFrame, second: pd.DataFrame, keys: Sequence[str]) -> list[str]:
    """Say what is constant inside each experiment and differs between them."""
    both = pd.concat([first, second], ignore_index=True)
    inside = {name for table in (first, second) for name in c.differing(table)}
    changed = [name for name in c.differing(both, keys) if name not in inside]
    return [f"A and B differ in {', '.join(changed)}."] if changed else []


def _duplicate_notes(table: pd.DataFrame, keys: Sequence[str], name: str) -> list[str]:
    """Say how many trials share the settings that pairs are made by, and what they differ in."""
    sizes = table.groupby([table[key] for key in keys], dropna=False).size()
    shared = int(sizes[sizes > 1].sum())
    if not shared:
        return []
    others = c.differing(table, keys)
    why = f"which differ in {', '.join(others)}" if others else "which differ in nothing that is recorded"
    return [
        f"{name}: {shared} of {len(table)} trials, {why}, are averaged to {int((sizes > 1).sum())} of a pair."
    ]


def _partner_notes(common: int, in_a: int, in_b: int) -> list[str]:
    told = [f"{n - common} of {name}" for name, n in (("A", in_a), ("B", in_b)) if n > common]
    return [f"Without a partner and left out: {', '.join(told)}."] if told else []


def _empty_notes(rows: Sequence[dict[str, object]], common: int) -> list[str]:
    left = [
        f"{row['head']} {common - int(str(row['pairs']))}" for row in rows if int(str(row["pairs"])) < common
    ]
    return [f"Pairs left out because a value is empty: {', '.join(left)} of {common}."] if left else []


def _compared(name: str, a: pd.Series, b: pd.Series) -> dict[str, object]:
    x, y = a.to_numpy(dtype=np.float64), b.to_numpy(dtype=np.float64)
    use = np.isfinite(x) & np.isfinite(y)
    x, y = x[use], y[use]
    difference, n = y - x, int(use.sum())
    half = float(stats.t.ppf(0.975, n - 1) * difference.std(ddof=1) / np.sqrt(n)) if n > 1 else None
    binary = name == c.SUCCESS and set(np.unique(np.concatenate((x, y)))) <= {0.0, 1.0}
    head, unit = head_of(name)
    return {
        "value": name,
        "head": f"{head} [{unit}]" if unit else head,
        "pairs": n,
        "A.mean": float(x.mean()) if n else None,
        "B.mean": float(y.mean()) if n else None,
        "difference": float(difference.mean()) if n else None,
        "ci": half,
        "higher": int((difference > 0).sum()),
        "lower": int((difference < 0).sum()),
        "test": "McNemar" if binary else "Wilcoxon",
        "p": _mcnemar(difference) if binary else _wilcoxon(difference),
    }


def _wilcoxon(difference: FloatArray) -> float:
    """Return the two-sided p of the signed rank test; 1 when nothing differs."""
    moved = difference[difference != 0]
    return float(stats.wilcoxon(moved).pvalue) if len(moved) else 1.0


def _mcnemar(difference: FloatArray) -> float:
    """Return the exact two-sided p: of the pairs that disagree, half should go either way."""
    gained, lost = int((difference > 0).sum()), int((difference < 0).sum())
    return float(stats.binomtest(gained, gained + lost).pvalue) if gained + lost else 1.0
