"""From overrides to one plain configuration tree, by Hydra's grammar and composition.

The typed schema (`graspbench.config.trial_config`) knows every key and its default; the YAML files of
the groups are named choices over it. Composing the choices of groups is cached, so that a sweep pays
for it once per combination of groups and only sets values afterwards.
"""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from hydra.core.override_parser.types import Override
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from graspbench.config.experiments import EXPERIMENT, keys_of
from graspbench.config.groups import CONF_DIR, group_options, store_options_without_file
from graspbench.config.hydra_composition import compose_files
from graspbench.config.option_files import check_option_files, has_resolver
from graspbench.config.overrides import first_line, parse_overrides
from graspbench.config.schema import (
    Primary,
    complete_with_defaults,
    follow,
)
from graspbench.config.values import Tree, flatten, set_value, suggestion
from graspbench.errors import ConfigurationError, shown


@dataclass(frozen=True)
class Composed:
    """A composed configuration and where its values come from.

    Attributes:
        tree: The configuration, complete with every default, interpolations resolved.
        choice: The option chosen of each group.
        overridden: Dotted keys that overrides or an experiment set.
    """

    tree: Tree
    choice: Mapping[str, str]
    overridden: tuple[str, ...]


def compose_tree(
    overrides: Sequence[str] = (), config_dir: Path | None = None, primary: Primary = "config"
) -> Tree:
    """Compose the configuration of one trial.

    Args:
        overrides: Hydra overrides without sweeps, for example ``["object=duck", "seed=3"]``.
        config_dir: A user's folder with further groups and options.
        primary: The primary configuration: ``config`` of a trial or ``manipulate``.

    Returns:
        The tree, complete with every default, interpolations resolved.

    Raises:
        ConfigurationError: A group, option or key is unknown, or an override cannot be parsed.
    """
    return compose_configuration(overrides, config_dir, primary).tree


def compose_configuration(
    overrides: Sequence[str] = (), config_dir: Path | None = None, primary: Primary = "config"
) -> Composed:
    """Compose the configuration of one trial, and tell what was chosen and what was overridden.

    Args:
        overrides: Hydra overrides without sweeps, for example ``["object=duck", "seed=3"]``.
        config_dir: A user's folder with further groups and options.
        primary: The primary configuration: ``config`` of a trial or ``manipulate``.

    Raises:
        ConfigurationError: A group, option or key is unknown, or an override cannot be parsed.
    """
    groups = group_options(config_dir, primary)
    choices: dict[str, str] = {}
    values: list[Override] = []
    for override in parse_overrides(overrides):
        text = override.input_line or ""
        if override.is_sweep_override():
            raise ConfigurationError(
                f"'{text}' gives several values where one trial takes one",
                remedy="use 'graspbench sweep' for a grid, or quote a list as [a,b]",
            )
        if override.is_delete():
            raise ConfigurationError(
                f"'{text}' deletes a key, which no configuration needs", remedy="leave it out"
            )
        value = override.value()
        if override.key_or_group in groups and isinstance(value, str):
            choices[override.key_or_group] = value
        elif override.key_or_group in groups and value is None:
            raise ConfigurationError(
                f"'{text}' names no option",
                remedy=f"choose one of {', '.join(groups[override.key_or_group])}",
            )
        else:
            values.append(override)
    for group, option in choices.items():
        _check_option(group, option, groups)
    composed, chosen = _compose_groups(tuple(sorted(choices.items())), config_dir, primary)
    tree = complete_with_defaults(composed, primary)
    for override in values:
        set_value(tree, override, groups)
    choice = {group: chosen[group] for group in groups if group in chosen}
    keys = [*keys_of(choice.get(EXPERIMENT), (config_dir, CONF_DIR)), *(each.key_or_group for each in values)]
    return Composed(follow(_resolved(tree)), choice, tuple(dict.fromkeys(keys)))


def _resolved(tree: Tree) -> Tree:
    """Return a tree with its interpolations filled in; most have none, and looking is much faster."""
    if "${" not in repr(tree):
        return copy.deepcopy(tree)
    for key, value in flatten(tree):
        if has_resolver(value):
            raise ConfigurationError(
                f"{key} = {shown(value)} cannot be used",
                remedy="only other keys may stand in ${...}: a trial must not depend on where it runs",
            )
    try:
        resolved = OmegaConf.to_container(OmegaConf.create(tree), resolve=True)
    except OmegaConfBaseException as error:
        raise ConfigurationError(f"an interpolation cannot be resolved ({first_line(error)})") from error
    assert isinstance(resolved, dict)
    return {str(key): value for key, value in resolved.items()}


def _check_option(group: str, option: str, groups: Mapping[str, Sequence[str]]) -> None:
    if option not in groups[group]:
        raise ConfigurationError(
            f"unknown {group} '{option}'",
            remedy=suggestion(option, groups[group]),
            group=group,
            option=option,
        )


@lru_cache(maxsize=1024)
def _compose_groups(
    choices: tuple[tuple[str, str], ...], config_dir: Path | None, primary: Primary
) -> tuple[Tree, dict[str, str]]:
    """Let Hydra compose the primary configuration with the chosen options; return the choices it made too."""
    store_options_without_file(config_dir)
    overrides = [f"{_IN_HYDRA.get(group, group)}={option}" for group, option in choices]
    if config_dir is not None:
        check_option_files(config_dir)
    try:
        composed, made = compose_files(primary, overrides, config_dir)
    except RecursionError as error:
        raise ConfigurationError(
            "the configuration's defaults include themselves", remedy="correct the files of --config-dir"
        ) from error
    except Exception as error:  # Hydra raises errors of many kinds over files that are not as it expects
        raise ConfigurationError(
            f"the configuration cannot be composed ({first_line(error)})",
            remedy="look at it with 'graspbench config'",
        ) from error
    return composed, _choices(made)


# An experiment's keys are those of the whole configuration, whatever its file says of a package.
_IN_HYDRA = {EXPERIMENT: f"{EXPERIMENT}@_global_"}


def _choices(made: Mapping[Any, Any]) -> dict[str, str]:
    """Return the option chosen of each group, as Hydra tells it."""
    ours = {name: group for group, name in _IN_HYDRA.items()}
    return {ours.get(str(group), str(group)): str(option) for group, option in made.items() if option}
