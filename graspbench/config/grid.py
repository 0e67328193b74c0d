"""From overrides with several values, and experiments with grids, to single trials."""

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hydra.core.override_parser.types import Glob, IntervalSweep, Override, RangeSweep, Transformer

from graspbench.config.compose import compose_tree
from graspbench.config.experiments import EXPERIMENT, grids_of, keys_of, named_experiment
from graspbench.config.groups import CONF_DIR, group_options
from graspbench.config.overrides import parse_overrides
from graspbench.config.schema import Primary
from graspbench.errors import ConfigurationError
from graspbench.geometry import list_folder

MAX_TRIALS = 20_000
_MAX_NUMBER = 1e18
_OBJECT_ID = "object.id"


def experiment_overrides(overrides: Sequence[str], config_dir: Path | None = None) -> list[str]:
    """Return what the experiment that overrides name sets itself, and the overrides of its grids.

    Raises:
        ConfigurationError: An override cannot be read.
    """
    named = [named_experiment(each) for each in parse_overrides(overrides) if _names(each)]
    roots = (config_dir, CONF_DIR)
    found = [f"{key}=" for name in named for key in keys_of(name, roots)]
    return [*found, *(text for name in named for grid in grids_of(name, roots) for text in grid)]


def experiment_only(overrides: Sequence[str]) -> list[str]:
    """Return the overrides that name an experiment.

    Raises:
        ConfigurationError: An override cannot be read.
    """
    return [text for text, each in zip(overrides, parse_overrides(overrides), strict=True) if _names(each)]


def _names(override: Override) -> bool:
    return bool(override.key_or_group == EXPERIMENT)


def expand_sweep(
    overrides: Sequence[str], config_dir: Path | None = None, primary: Primary = "config"
) -> list[tuple[str, ...]]:
    """Expand Hydra's sweep grammar into the grid of single trials.

    Args:
        overrides: For example ``["object=teddy,bottle", "index.k_cm=0,1", "seed=range(0,3)"]``.
        config_dir: A user's folder with further groups and options.
        primary: The primary configuration that the groups belong to.

    Returns:
        One tuple of plain overrides a trial; the last override varies fastest.

    Raises:
        ConfigurationError: An override cannot be parsed, a glob matches nothing, or the grid is too large.
    """
    parsed = parse_overrides(overrides)
    experiments = [override for override in parsed if _names(override)]
    names = [named_experiment(override) for override in experiments]
    cells: dict[tuple[str, ...], None] = {}
    for grid in grids_of(names[-1] if names else None, (config_dir, CONF_DIR)):
        given = {override.key_or_group for override in parsed}
        all_of_cell = [*(each for each in parse_overrides(grid) if each.key_or_group not in given), *parsed]
        axes = [_axis(override, all_of_cell, config_dir, primary) for override in all_of_cell]
        _check_size(len(cells) + math.prod(len(axis) for axis in axes))
        cells |= dict.fromkeys(itertools.product(*axes))
    return list(cells)


def _check_size(trials: float) -> None:
    if trials > MAX_TRIALS:
        raise ConfigurationError(
            f"the grid has {trials:.4g} trials",
            remedy=f"a sweep has at most {MAX_TRIALS}: make several of it",
        )


def _axis(
    override: Override, others: Sequence[Override], config_dir: Path | None, primary: Primary
) -> list[str]:
    key = override.get_key_element()
    value: Any = override.value()
    if isinstance(value, Glob):
        options = group_options(config_dir, primary).get(override.key_or_group, ())
        if override.key_or_group == _OBJECT_ID:
            options = _object_ids(others, config_dir)
        names = value.filter(list(options))
        if not names:
            raise ConfigurationError(
                f"'{override.input_line}' matches no option",
                remedy=f"choose from {', '.join(options) or 'a configuration group'}",
            )
        return [f"{key}={name}" for name in names]
    if not override.is_sweep_override():
        return [override.input_line or ""]
    if isinstance(value, IntervalSweep):
        raise ConfigurationError(
            f"'{override.input_line}' is an interval, of which a grid cannot try every value",
            remedy="give single values or range(first,end,step), or search it with 'graspbench tune'",
        )
    if isinstance(value, RangeSweep):
        _check_range(override, value)
    return [f"{key}={item}" for item in override.sweep_iterator(transformer=Transformer.encode)]


def _check_range(override: Override, found: RangeSweep) -> None:
    """Refuse a range without an end, or of more values than a grid may have."""
    start, stop, step = found.start or 0, found.stop or 0, found.step
    if not all(abs(number) <= _MAX_NUMBER for number in (start, stop, step)) or step == 0:
        raise ConfigurationError(
            f"'{override.input_line}' is no range",
            remedy="write range(first,end,step) with a step that leads on",
        )
    _check_size((stop - start) / step)


def _object_ids(overrides: Sequence[Override], config_dir: Path | None) -> tuple[str, ...]:
    """Return the names in the folder that a sweep takes its objects from."""
    of_object = [item for item in overrides if item.get_key_element().split(".")[0] == "object"]
    single = [item.input_line or "" for item in of_object if not item.is_sweep_override()]
    folder = compose_tree(single, config_dir)["object"]["folder"]
    return () if folder is None else tuple(item.name for item in list_folder(Path(folder).expanduser()))
