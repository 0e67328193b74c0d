"""Hydra's composition of option files, without the configuration of Hydra itself.

Hydra composes its own launchers, loggers and help along with a program's options, and reads every file anew
each time: that is three quarters of the time, for values that nobody reads here.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hydra import version
from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra._internal.config_repository import CachingConfigRepository, ConfigRepository
from hydra._internal.defaults_list import create_defaults_list
from hydra._internal.utils import create_config_search_path
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import OmegaConf

from graspbench.config.groups import CONF_DIR

_OURS = "main"
"""What Hydra calls the folder of the program's own files."""

_HYDRAS_OWN = "hydra"
_kept: dict[str, Any] = {}


def compose_files(
    primary: str, overrides: Sequence[str], config_dir: Path | None
) -> tuple[dict[str, Any], Mapping[Any, Any]]:
    """Compose a primary configuration with chosen options.

    Args:
        primary: Name of the primary configuration.
        overrides: Choices of groups, ``group=option``.
        config_dir: A user's folder with further groups and options.

    Returns:
        The values, interpolations unresolved, and the option chosen of each group.

    Raises:
        Exception: A file or a choice is not as Hydra expects; it raises errors of many kinds.
    """
    version.setbase("1.3")
    path: Any = create_config_search_path(str(CONF_DIR))
    if config_dir is not None:  # found whatever characters its path has
        path.append("user", f"file://{config_dir.resolve()}")
        entries = path.get_path()
        entries[-2:] = entries[:-3:-1]  # Hydra wants its own schemas to be last
    loader = ConfigLoaderImpl(path)
    files = CachingConfigRepository(_Files(path))
    defaults = create_defaults_list(
        repo=files,
        config_name=primary,
        overrides_list=OverridesParser.create().parse_overrides(list(overrides)),
        prepend_hydra=False,
        skip_missing=False,
    )
    found = loader._compose_config_from_defaults_list(defaults=defaults.defaults, repo=files)
    OmegaConf.set_struct(found, True)
    loader._apply_overrides_to_config(defaults.config_overrides, found)
    composed = OmegaConf.to_container(found)
    assert isinstance(composed, dict)
    values = {str(key): value for key, value in composed.items() if key != _HYDRAS_OWN}
    return values, defaults.overrides.known_choices


class _Files(ConfigRepository):
    """Option files, of which the program's own are read once: they do not change while it runs."""

    def load_config(self, config_path: str) -> Any:
        """Return a file's content, None if there is no such file."""
        if config_path in _kept:
            return _kept[config_path]
        found = super().load_config(config_path)
        if found is not None and found.provider == _OURS:
            _kept[config_path] = found
        return found
