"""Groups beside the configuration of a trial: read from their option files and overrides alone."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from graspbench.config.groups import CONF_DIR
from graspbench.config.overrides import parse_override
from graspbench.errors import ConfigurationError, shown
from graspbench.yaml_files import check_plain, read_yaml

T = TypeVar("T")


def parsed_value(text: str, group: str) -> tuple[str, Any]:
    """Return key and value of an override ``key=value``.

    Raises:
        ConfigurationError: It is none, or stands for several values.
    """
    override = parse_override(text)
    if override.is_sweep_override() or override.is_delete():
        raise ConfigurationError(f"'{text}' is no single value", remedy=f"give one {group}")
    value = override.value()
    return override.key_or_group, getattr(value, "text", value)


def option_names(group: str, config_dir: Path | None) -> tuple[str, ...]:
    """Return the options of a group that have a file."""
    return tuple(sorted({path.stem for root in _roots(config_dir) for path in (root / group).glob("*.yaml")}))


def option_content(group: str, choice: str, config_dir: Path | None) -> dict[str, Any]:
    """Return what the file of an option holds.

    Raises:
        ConfigurationError: There is no such option, or its file is no mapping.
    """
    for root in _roots(config_dir):
        path = root / group / f"{choice}.yaml"
        if path.is_file():
            content = read_yaml(path)
            if not isinstance(content, dict | None):
                raise ConfigurationError(f"{path} is no mapping of options", remedy="write KEY: VALUE lines")
            check_plain(content, group)
            return {str(key): value for key, value in (content or {}).items()}
    names = ", ".join(option_names(group, config_dir))
    raise ConfigurationError(f"unknown {group} '{choice}'", remedy=f"choose one of {names}")


def validated(kind: type[T], content: Mapping[str, Any], prefix: str) -> T:
    """Return a dataclass of parameters made of plain values.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    known = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
    if unknown := sorted(set(content) - set(known)):
        raise ConfigurationError(
            f"unknown option '{prefix}.{unknown[0]}'", remedy=f"choose one of {', '.join(known)}"
        )
    try:
        return TypeAdapter(kind).validate_python(dict(content))
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join([prefix, *(str(part) for part in first["loc"])])
        raise ConfigurationError(
            f"{key} = {shown(first['input'])} cannot be used",
            remedy=first["msg"][:1].lower() + first["msg"][1:],
        ) from error


def _roots(config_dir: Path | None) -> list[Path]:
    return [root for root in (config_dir, CONF_DIR) if root is not None]
