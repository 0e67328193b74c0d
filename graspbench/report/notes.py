"""What a reader of a table of trials must be told about them."""

from collections.abc import Sequence

import pandas as pd

from graspbench.report.columns import (
    COMMIT,
    CONTACT,
    DIRTY,
    DONE,
    EXECUTED_FRICTION,
    PLANNED_FRICTION,
    STATUS,
    SUCCESS,
    TORQUE_LENGTH,
    VERSION,
    WRENCH_SPACE,
    differing,
    numbers,
)

_COMMIT_LETTERS = 10


def trial_notes(trials: pd.DataFrame, shown: Sequence[str] = ()) -> tuple[str, ...]:
    """Return what holds for any table of these trials: contacts, what it pools, which versions it mixes.

    Args:
        trials: One row a trial.
        shown: Columns that the table tells its rows apart by.
    """
    return (*model_notes(trials), *pooled_notes(trials, shown), *version_notes(trials))


def model_notes(trials: pd.DataFrame) -> tuple[str, ...]:
    """Return a sentence that says what the measures are of: contact model, wrenches, friction, torque length.

    Only what all trials share is said; what they differ in is named by `pooled_notes`.
    """
    models, spaces, planned, executed, lengths = (
        sorted(_texts(trials, name))
        for name in (CONTACT, WRENCH_SPACE, PLANNED_FRICTION, EXECUTED_FRICTION, TORQUE_LENGTH)
    )
    parts = [f"{models[0].replace('_', ' ')} contacts"] if len(models) == 1 else []
    if len(spaces) == 1:
        parts.append(f"wrenches {spaces[0].replace('_', ' ')}")
    if len(planned) == 1:
        apart = len(executed) == 1 and executed != planned
        parts.append(f"friction {planned[0]}" + (f", executed at {executed[0]}" if apart else ""))
    if len(lengths) == 1:
        parts.append("torque length " + (lengths[0] if lengths[0] == "auto" else f"{lengths[0]} m"))
    text = ", ".join(parts)
    return (f"{text[0].upper()}{text[1:]}.",) if text else ()


def pooled_notes(trials: pd.DataFrame, shown: Sequence[str] = ()) -> tuple[str, ...]:
    """Return a sentence that names what trials of one row differ in; none where they do not."""
    names = differing(trials, shown)
    return (f"Pools trials that differ in {', '.join(names)}.",) if names else ()


def version_notes(trials: pd.DataFrame) -> tuple[str, ...]:
    """Return a sentence where trials come from several versions or commits of the code."""
    parts = []
    for name, word in ((VERSION, "versions"), (COMMIT, "commits")):
        values = sorted(_texts(trials, name))
        if len(values) > 1:
            parts.append(f"{word} {', '.join(value[:_COMMIT_LETTERS] for value in values)}")
    if not parts and len(_texts(trials, DIRTY)) > 1:
        parts.append("one commit with and without changes that were not committed")
    return (f"Mixes results of different code: {'; '.join(parts)}.",) if parts else ()


def status_notes(trials: pd.DataFrame) -> tuple[str, ...]:
    """Return a sentence that counts trials without a result by status; none where all are done."""
    counts = trials[STATUS].map(str).value_counts()
    left = {str(status): int(count) for status, count in counts.items() if status != DONE}
    if not left:
        return ()
    told = ", ".join(f"{count} {status}" for status, count in sorted(left.items()))
    return (f"Of {len(trials)} trials {told}: not in the means.",)


def success_notes(trials: pd.DataFrame) -> tuple[str, ...]:
    """Return a sentence that counts the trials of which success is not known; none where it always is."""
    if SUCCESS not in trials:
        return ()
    unknown = int(numbers(trials, SUCCESS).isna().sum())
    if not unknown:
        return ()
    return (
        f"Success is empty in {unknown} of {len(trials)} trials, where nothing was executed: "
        "left out of rates, tests and correlations.",
    )


def _texts(trials: pd.DataFrame, name: str) -> set[str]:
    return set(trials[name].dropna().map(str)) if name in trials else set()
