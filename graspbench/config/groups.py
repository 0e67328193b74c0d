"""The groups of the configuration and their options: files, plug-ins, catalogue objects."""

from functools import lru_cache
from pathlib import Path

from hydra.core.config_store import ConfigStore

import graspbench.conf
from graspbench.config.experiments import NO_TRIAL_GROUPS
from graspbench.config.schema import MANIPULATION_SECTIONS, PLUGGED, Primary
from graspbench.geometry import list_objects

CONF_DIR = Path(graspbench.conf.__path__[0])


def group_options(config_dir: Path | None = None, primary: Primary = "config") -> dict[str, tuple[str, ...]]:
    """Return the options of every configuration group, plug-ins included.

    Args:
        config_dir: A user's folder with further groups and options.
        primary: The primary configuration that the groups belong to.

    Returns:
        Options by group; a group inside another is called ``outer/inner``.
    """
    options: dict[str, set[str]] = {}
    for root in filter(None, (CONF_DIR, config_dir)):
        for group, name in _own_options() if root == CONF_DIR else _options_in(Path(root)):
            if group in NO_TRIAL_GROUPS:
                continue
            if primary == "manipulate" or group.split("/")[0] not in MANIPULATION_SECTIONS:
                options.setdefault(group, set()).add(name)
    for group, names in _options_without_file().items():
        options.setdefault(group, set()).update(names)
    return {group: tuple(sorted(names)) for group, names in sorted(options.items())}


def _options_in(root: Path) -> tuple[tuple[str, str], ...]:
    """Return group and name of each option that has a file below a folder."""
    files = [*root.glob("*/*.yaml"), *root.glob("*/*/*.yaml")]
    return tuple((path.parent.relative_to(root).as_posix(), path.stem) for path in sorted(files))


@lru_cache(maxsize=1)
def _own_options() -> tuple[tuple[str, str], ...]:
    return _options_in(CONF_DIR)


def _options_without_file() -> dict[str, tuple[str, ...]]:
    """Return the options that are nothing but a name: of plug-ins, and catalogue objects."""
    plugged = {group: registry.names() for group, (registry, _) in PLUGGED.items()}
    return {**plugged, "object": list_objects()}


def store_options_without_file(config_dir: Path | None) -> None:
    """Let Hydra know these options, but for those that have a file: it would take them for its schema."""
    store = ConfigStore.instance()
    for group, names in _options_without_file().items():
        store.repo.pop(group, None)
        files = [
            path.stem for root in (CONF_DIR, config_dir) if root for path in (root / group).glob("*.yaml")
        ]
        for name in sorted(set(names) - set(files)):
            store.store(name, {"name": name}, group=group, provider="graspbench")
