"""Arguments that several commands share, and their shell completion."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer

import graspbench.conf
from graspbench.cli.option_values import OPTION_VALUES
from graspbench.datasets import catalogue_files

_CONF_DIR = Path(graspbench.conf.__path__[0])


def complete_override(incomplete: str) -> list[str]:
    """Complete ``group=``, ``group=option`` and ``group.key=`` from the configuration files alone.

    No library of the package proper is imported, so that the shell answers at once.
    """
    key, equals, value = incomplete.partition("=")
    if equals:
        before, comma, last = value.rpartition(",")
        chosen = set(before.split(",")) if comma else set()
        options = [option for option in _values(key) if option.startswith(last) and option not in chosen]
        return [f"{key}={before}{comma}{option}" for option in options]
    if "." in key:
        return [f"{name}=" for name in _keys(key.split(".", 1)[0]) if name.startswith(key)]
    groups, sections = _groups(), group_names()
    names = [f"{group}=" for group in groups] + [f"{section}." for section in sections] + ["seed="]
    return [name for name in names if name.startswith(key)]


def complete_object(incomplete: str) -> list[str]:
    """Complete the name of a catalogue object."""
    return sorted(name for name in catalogue_files() if name.startswith(incomplete))


def complete_list(values: Sequence[str]) -> Callable[[str], list[str]]:
    """Return what completes a comma-separated list of some values."""

    def complete(incomplete: str) -> list[str]:
        before, comma, last = incomplete.rpartition(",")
        chosen = set(before.split(","))
        return [
            f"{before}{comma}{value}" for value in values if value.startswith(last) and value not in chosen
        ]

    return complete


def group_names() -> list[str]:
    """Return the groups of a configuration, those inside others left out."""
    return [group for group in _groups() if "/" not in group]


def _groups() -> list[str]:
    """Return the groups and, as ``outer/inner``, the groups inside them."""
    files = [*_CONF_DIR.glob("*/*.yaml"), *_CONF_DIR.glob("*/*/*.yaml")]
    return sorted({path.parent.relative_to(_CONF_DIR).as_posix() for path in files})


def _values(key: str) -> list[str]:
    """Return the options of a group, or the values of a key that has a few."""
    if "." not in key:
        named = catalogue_files() if key == "object" else {}
        return sorted({*named, *(path.stem for path in (_CONF_DIR / key).glob("*.yaml"))})
    return list(OPTION_VALUES.get(key, ()))


def _keys(group: str) -> list[str]:
    return sorted({name for name, _ in _leaves(group)})


def _leaves(group: str) -> Iterator[tuple[str, object]]:
    import yaml  # what only prints help need not load it

    for path in sorted((_CONF_DIR / group).glob("*.yaml")):
        content = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
        content.pop("defaults", None)  # Hydra's own, no option
        stack = [(group, content)]
        while stack:
            prefix, node = stack.pop()
            if isinstance(node, dict):
                stack += [(f"{prefix}.{key}", child) for key, child in node.items()]
            else:
                yield prefix, node


Overrides = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[OVERRIDES]...",
        help="Hydra overrides: group=option or group.key=value.",
        autocompletion=complete_override,
        show_default=False,
    ),
]

ConfigDir = Annotated[
    Path | None,
    typer.Option(
        "--config-dir",
        exists=True,
        file_okay=False,
        help="A folder with your own configuration groups and options.",
        show_default=False,
    ),
]

Timeout = Annotated[
    float | None,
    typer.Option(min=0.1, max=2_592_000, help="Seconds a trial may take.", show_default=False),
]

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document instead of tables.")]
