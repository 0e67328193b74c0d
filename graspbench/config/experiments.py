"""Experiment files: a name for a choice of options and values, and for the grids of a study.

``conf/experiment/NAME.yaml`` holds Hydra defaults (``override /group: option``), values of any key, and
under ``grids`` lists of overrides in the grammar of a sweep; ``experiment=NAME`` chooses it. What a file
sets can be overridden on the command line.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hydra.core.override_parser.types import Override

from graspbench.errors import ConfigurationError
from graspbench.yaml_files import read_yaml

EXPERIMENT = "experiment"
GRIDS = "grids"

# Groups that say nothing of a trial: where a sweep is run, how grasps are tried afterwards.
NO_TRIAL_GROUPS = ("engine", "protocol")

Roots = Sequence[Path | None]


def named_experiment(override: Override) -> str:
    """Return the experiment that an override names.

    Raises:
        ConfigurationError: It names several.
    """
    value = override.value()
    if override.is_sweep_override() or not isinstance(value, str):
        raise ConfigurationError(
            f"'{override.input_line}' does not name one experiment", remedy="give a sweep one experiment"
        )
    return value


def grids_of(name: str | None, roots: Roots) -> list[list[str]]:
    """Return the grids of an experiment, each a list of overrides; one without any when it names none.

    Raises:
        ConfigurationError: They are no lists of overrides.
    """
    grids = (_content(name, roots) or {}).get(GRIDS)
    if grids is None:
        return [[]]
    if not isinstance(grids, list) or not all(
        isinstance(grid, list) and all(isinstance(text, str) for text in grid) for grid in grids
    ):
        raise ConfigurationError(
            f"the grids of experiment '{name}' cannot be used",
            remedy="write a list of lists of overrides: grids: [[object=duck, 'seed=0,1'], [object=teddy]]",
        )
    return grids


def keys_of(name: str | None, roots: Roots) -> Iterator[str]:
    """Yield the dotted keys of a trial that an experiment sets itself."""
    content = _content(name, roots) or {}
    yield from _leaves({key: value for key, value in content.items() if key not in ("defaults", GRIDS)}, "")


def _leaves(node: dict[str, Any], prefix: str) -> Iterator[str]:
    for key, value in node.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}"


def _content(name: str | None, roots: Roots) -> dict[str, Any] | None:
    for root in roots if name else ():
        path = Path(root) / EXPERIMENT / f"{name}.yaml" if root is not None else None
        if path is not None and path.is_file():
            content = read_yaml(path)
            return content if isinstance(content, dict) else None
    return None
