"""The columns of a table of trials: their values, and the dictionary that says what each means."""

import dataclasses
import json
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Union

from graspbench.results.about import About, unit_of
from graspbench.results.trial_result import TrialResult

if TYPE_CHECKING:
    import pandas as pd

# What every table says first; then the choices and the keys that any of its trials overrode.
_FIRST = ("trial_id", "status", "reason", "success")
_CHOICE = "choice"
_SWITCH = "yes or no"

OVERRIDDEN = "overridden"
"""Key of a table's ``attrs``: its columns that are overridden keys of the configuration."""
# Parts of the configuration that every row has: what planning and execution may have set apart, and what
# an in-hand motion was.
_ALWAYS = (
    "quality.contact",
    "quality.wrench_space",
    "quality.friction",
    "quality.torque_length",
    "stations",
    "scene.motion",
    "motion",
    "contact.kind",
    "clik.method",
)


@dataclass(frozen=True)
class ColumnDescription:
    """What a column means.

    Attributes:
        name: Its name; ``<...>`` stands for one part that a trial chooses, such as a measure.
        unit: Its unit, or what kind of value it has.
        meaning: What it says.
        empty: When it has no value; "" when it always has one.
    """

    name: str
    unit: str
    meaning: str
    empty: str


@dataclass(frozen=True)
class TrialRows:
    """Trials as rows of a table.

    Attributes:
        columns: The columns' names.
        rows: One a trial, by column; what a trial has not is not there.
        overridden: Those columns that are overridden keys of the configuration.
    """

    columns: tuple[str, ...]
    rows: tuple[dict[str, Any], ...]
    overridden: tuple[str, ...]


def trial_rows(results: Sequence[TrialResult], folders: Mapping[str, str] | None = None) -> TrialRows:
    """Turn results into one row a trial with dotted column names; lists are left to the files.

    Args:
        results: The trials.
        folders: Each trial's folder by its id, for a column ``folder``; None for no such column.
    """
    overridden = list(dict.fromkeys(key for result in results for key in result.overridden))
    rows = []
    for result in results:
        row = _row(result, overridden)
        if folders is not None:
            row["folder"] = folders[result.trial_id]
        rows.append(row)
    columns = dict.fromkeys(_FIRST)
    for prefix in (f"{_CHOICE}.", *overridden):
        columns |= dict.fromkeys(name for row in rows for name in row if _below(name, prefix))
    columns |= dict.fromkeys(name for row in rows for name in row)
    chosen = tuple(name for name in columns if any(_below(name, key) for key in overridden))
    return TrialRows(tuple(columns), tuple(rows), chosen)


def results_frame(results: Sequence[TrialResult], folders: Mapping[str, str] | None = None) -> "pd.DataFrame":
    """Return `trial_rows` as a table of pandas; see there for the arguments."""
    import pandas as pd  # only tables need it, and it is slow to load

    table = trial_rows(results, folders)
    frame = pd.DataFrame(table.rows, columns=list(table.columns))
    frame.attrs[OVERRIDDEN] = list(table.overridden)
    return frame


def is_switch(name: str) -> bool:
    """Tell whether a column says yes or no."""
    described = describe_column(name)
    return described is not None and described.unit == _SWITCH


def describe_column(name: str) -> ColumnDescription | None:
    """Return what a column means: one of a result's fields, or a key of the configuration.

    Args:
        name: A column of ``trials.csv``.
    """
    for described in result_columns():
        if _matches(name, described.name):
            return dataclasses.replace(described, name=name)
    return None


@cache
def result_columns() -> tuple[ColumnDescription, ...]:
    """Return the dictionary of a result's own columns, in the order of the tables."""
    described = {column.name: column for column in _described(TrialResult, "", "")}
    first = [described.pop(name) for name in _FIRST]
    return (*first, *described.values())


def columns_reference() -> str:
    """Return the dictionary of columns as a page in Markdown."""
    lines = [_INTRODUCTION, "| column | unit | meaning | empty when |", "|---|---|---|---|"]
    for column in result_columns():
        cells = (f"`{column.name}`", column.unit, column.meaning, column.empty)
        lines.append("| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


_INTRODUCTION = f"""\
# Columns

<!-- Written by `graspbench config --columns`; a test keeps it in step with the code. -->

The columns of `trials.csv` and `trials.parquet`, one row a trial. First come {_listed(_FIRST)};
then the option chosen of each configuration group, `choice.<group>`; then each key that the command line
or an experiment set for any trial of the folder, under its own name, with every trial's value; then what
came of the trial. `<...>` stands for a name that the trial chose: a measure, a stage, a phase. Keys of the
configuration ({_listed(_ALWAYS)}
always, others where they were set) are explained in the [configuration's reference](configuration.md).
"""


def _row(result: TrialResult, overridden: Sequence[str]) -> dict[str, Any]:
    row: dict[str, Any] = {}
    _fill(row, result, "")
    for key in overridden:  # what was asked for, where a field of the result has the same name
        found = _at(result.config, key)
        if found is not None and not isinstance(found, Mapping):
            row[key] = _cell(found)
    for key in (*overridden, *_ALWAYS):
        found = _at(result.config, key)
        if isinstance(found, Mapping):
            _fill(row, found, f"{key}.")
        elif found is not None:
            row.setdefault(key, _cell(found))
    return row


def _fill(row: dict[str, Any], value: Any, prefix: str) -> None:
    """Set the columns of a dataclass or a mapping; lists and what is no column are left out."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            if isinstance(item, Mapping) or dataclasses.is_dataclass(item):
                _fill(row, item, f"{prefix}{key}.")
            else:
                row.setdefault(f"{prefix}{key}", _cell(item))
        return
    for name, key, is_part in _column_fields(_type_of(value)):
        item = getattr(value, name)
        if isinstance(item, Mapping) or dataclasses.is_dataclass(item):
            _fill(row, item, f"{prefix}{key}.")
        elif not (is_part or isinstance(item, list | tuple)):
            row[prefix + key] = item


def _type_of(value: Any) -> Any:
    return type(value)


def _cell(value: Any) -> Any:
    """Return a value of the configuration as one cell."""
    return json.dumps(value, ensure_ascii=False) if isinstance(value, list | tuple) else value


def _at(tree: Mapping[str, Any], path: str) -> Any:
    node: Any = tree
    for part in path.split("."):
        node = node.get(part) if isinstance(node, Mapping) else None
    return node


def _below(name: str, prefix: str) -> bool:
    return (
        name.startswith(prefix) if prefix.endswith(".") else name == prefix or name.startswith(f"{prefix}.")
    )


@cache
def _column_fields(kind: Any) -> tuple[tuple[str, str, bool], ...]:
    """Return the fields of a part that may be columns: name, name there, whether it is a part of its own."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return tuple(
        (field.name, field.name.rstrip("_"), _is_part(hints[field.name]))
        for field in dataclasses.fields(kind)
        if _about(hints[field.name]).column and _inner(hints[field.name])[0] is not None
    )


def _described(kind: Any, prefix: str, empty: str) -> Iterator[ColumnDescription]:
    hints = typing.get_type_hints(kind, include_extras=True)
    for name, key, _ in _column_fields(kind):
        about = _about(hints[name])
        when = "; ".join(dict.fromkeys(filter(None, (empty, about.empty))))
        inner, mapped = _inner(hints[name])
        column = f"{prefix}{key}" + (f".<{_KEYS.get(key, 'name')}>" if mapped else "")
        if dataclasses.is_dataclass(inner):
            yield from _described(inner, f"{column}.", when)
        else:
            # The name of a yes or no may end like that of a quantity.
            unit = _SWITCH if inner is bool else unit_of(key, about.unit) or _kind(inner)
            yield ColumnDescription(column, unit, about.meaning, when)


_KEYS = {
    "choice": "group",
    "index": "parameter",
    "global": "measure",
    "ratio": "measure",
    "refined": "measure",
    "measures": "measure",
    "phases": "phase",
    "steps": "step",
    "times_s": "stage",
    "libraries": "library",
}


def _is_part(hint: Any) -> bool:
    inner, mapped = _inner(hint)
    return mapped or dataclasses.is_dataclass(inner)


def _about(hint: Any) -> About:
    """Return what a field means: the last of its annotations."""
    return next(item for item in reversed(typing.get_args(hint)) if isinstance(item, About))


def _inner(hint: Any) -> tuple[Any, bool]:
    """Return the type of a column's values, and whether it is the values of a mapping; None for lists."""
    if typing.get_origin(hint) is typing.Annotated:
        return _inner(typing.get_args(hint)[0])
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (Union, types.UnionType):
        return _inner(next(item for item in arguments if item is not type(None)))
    if origin is typing.Literal:
        return str, False
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return _inner(arguments[1])[0], True
    if origin is tuple:
        return None, False
    return hint, False


def _kind(kind: Any) -> str:
    return {bool: _SWITCH, int: "count", str: "text"}.get(kind, "")


def _matches(name: str, pattern: str) -> bool:
    """Tell whether a column is one that a description stands for; a chosen name may hold dots."""
    if "<" not in pattern:
        return name == pattern
    head, _, rest = pattern.partition("<")
    tail = rest.partition(">")[2]
    if not name.startswith(head):
        return False
    if "<" in tail:
        inner = tail.partition("<")[0]
        at = name.find(inner, len(head))
        return at > len(head) and _matches(name[at:], tail)
    return (
        len(name) > len(head) + len(tail)
        and name.endswith(tail)
        and (bool(tail) or "." not in name[len(head) :] or head in ("choice.", "index.", "provenance.git."))
    )
