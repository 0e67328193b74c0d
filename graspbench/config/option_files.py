"""The files of a user's configuration folder, looked at before Hydra reads them."""

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from graspbench.errors import ConfigurationError, shown
from graspbench.yaml_files import check_plain, read_yaml

MAX_ENTRIES = 20_000
_RESOLVER = re.compile(r"\$\{[^{}]*:")


def check_option_files(config_dir: Path) -> None:
    """Refuse a folder with a file that is no option: no YAML, no mapping, or one that reads its surroundings.

    Raises:
        ConfigurationError: The message names the file.
    """
    for path in sorted(_files(config_dir)):
        content = read_yaml(path)
        if content is None or path.parent == config_dir:  # no option, whatever else it is
            continue
        if not isinstance(content, Mapping):
            raise ConfigurationError(
                f"{path} is no mapping of options but {shown(content)}", remedy="write KEY: VALUE lines"
            )
        check_plain(content, path.stem)
        if has_resolver(content):
            raise ConfigurationError(
                f"{path} takes a value from where it is read (${{...:...}})",
                remedy="write the value itself: a file that is shared must mean the same everywhere",
            )


def _files(config_dir: Path) -> Iterator[Path]:
    """Yield the YAML files at any depth, as the defaults of one may name another."""
    seen = 0
    for place, folders, names in os.walk(config_dir, followlinks=True):
        seen += len(folders) + len(names)
        if seen > MAX_ENTRIES:
            raise ConfigurationError(
                f"{config_dir} holds more than {MAX_ENTRIES} files or folders, or itself",
                remedy="give a folder of configuration groups alone",
            )
        yield from (Path(place, name) for name in (*names, *folders) if name.endswith(".yaml"))


def has_resolver(value: Any) -> bool:
    """Tell whether text, or any text in a list or mapping, holds an interpolation that computes something."""
    if isinstance(value, str):
        return _RESOLVER.search(value) is not None
    if isinstance(value, Mapping):
        return any(has_resolver(item) for pair in value.items() for item in pair)
    if isinstance(value, list | tuple):
        return any(has_resolver(item) for item in value)
    return False
