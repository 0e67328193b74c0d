"""Values set in a configuration tree, each by its dotted key."""

import copy
import dataclasses
import difflib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from hydra.core.override_parser.types import Override

from graspbench.config.overrides import parse_overrides
from graspbench.config.schema import TASKS_KEY, complete_tasks, refuse_moved
from graspbench.errors import ConfigurationError
from graspbench.planning import INDICES

Tree = dict[str, Any]


def set_values(tree: Tree, overrides: Sequence[str]) -> Tree:
    """Return a complete tree with some of its values set anew; no option of a group can be chosen there.

    Raises:
        ConfigurationError: An override cannot be read, is no single value, or names no key.
    """
    changed = copy.deepcopy(tree)
    for override in parse_overrides(overrides):
        if override.is_sweep_override() or override.is_delete():
            raise ConfigurationError(
                f"'{override.input_line}' is no single value", remedy="give each key one value"
            )
        set_value(changed, override, {})
    return changed


def flatten(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield ``("group.key", value)`` for every leaf of a tree."""
    for key, value in tree.items():
        if isinstance(value, Mapping) and value:
            yield from flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def set_value(tree: Tree, override: Override, groups: Mapping[str, Sequence[str]]) -> None:
    """Set one value; the key must exist, so that a misspelt one is found at once."""
    path = override.key_or_group
    _admit_task(tree, path)
    *parents, last = path.split(".")
    node: Any = tree
    for parent in parents:
        node = node.get(parent) if isinstance(node, dict) else None
    if not isinstance(node, dict) or last not in node:
        refuse_moved(path)
        _check_other_indices(tree, path, override)
        known = [key for key, _ in flatten(tree)] + list(groups)
        raise ConfigurationError(
            f"unknown option '{path}'", remedy=suggestion(path, known), override=override.input_line
        )
    value = override.value()
    if isinstance(node[last], dict) and not isinstance(value, dict):
        raise ConfigurationError(
            f"'{path}' is a group of options, not a value",
            remedy=f"set one of {', '.join(f'{path}.{key}' for key in node[last])}",
        )
    if isinstance(value, dict) and isinstance(node[last], dict):
        unknown = sorted(set(value) - set(node[last]))
        if unknown:
            raise ConfigurationError(
                f"unknown option '{path}.{unknown[0]}'", remedy=suggestion(unknown[0], list(node[last]))
            )
        node[last].update(_plain(value))
    else:
        node[last] = _plain(value)


def _check_other_indices(tree: Tree, path: str, override: Override) -> None:
    """Refuse an option of another index by naming whose it is, and how a sweep combines both."""
    section, _, key = path.partition(".")
    if section != "index":
        return
    chosen, others = tree[section]["name"], [name for name in INDICES if _has(INDICES[name].parameters, key)]
    if others:
        grids = f"[[index={others[0]}, '{override.input_line}'], [index={chosen}]]"
        raise ConfigurationError(
            f"the index {chosen} has no option '{key}', which belongs to {', '.join(others)}",
            remedy=f"leave it out, or give each index its own grid in an experiment file (grids: {grids})",
            override=override.input_line,
        )


def _has(parameters: type, key: str) -> bool:
    return key.partition(".")[0] in {field.name for field in dataclasses.fields(parameters)}


def _admit_task(tree: Tree, path: str) -> None:
    """Let an override of a task's option bring the task in, with its defaults."""
    prefix = f"{TASKS_KEY}."
    if "clik" in tree and path.startswith(prefix):
        name = path.removeprefix(prefix).split(".")[0]
        if name not in tree["clik"]["tasks"]:
            tree["clik"]["tasks"] |= complete_tasks({name: {}})


def _plain(value: Any) -> Any:
    """Turn Hydra's quoted strings and containers into plain Python values."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return getattr(value, "text", value)


def suggestion(word: str, known: Sequence[str]) -> str:
    """Return a remedy for a word that is not known: what it may have been meant for, or what there is."""
    close = difflib.get_close_matches(word, known, n=3, cutoff=0.6)
    if close:
        return f"did you mean {' or '.join(close)}?"[:-1]
    if len(known) <= 40:
        return f"choose one of {', '.join(known)}"
    return "'graspbench config' prints every option"
