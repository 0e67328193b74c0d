"""The typed schema of a trial's configuration: every section, its parameters and their defaults.

Each section is the frozen dataclass of parameters of the stage that reads it, so that a key is written
once: in the stage. The section ``index`` takes the parameters of the index it names.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

from graspbench.errors import ConfigurationError
from graspbench.geometry import ObjectParameters
from graspbench.grasp import QualityParameters
from graspbench.hand import HandParameters
from graspbench.perception import CameraParameters, SilhouetteParameters, StationParameters
from graspbench.planning import INDICES, PlannerParameters, SearchParameters
from graspbench.reconstruction import SurfaceParameters
from graspbench.record import RecordParameters
from graspbench.simulation import SceneParameters
from graspbench.simulation.execution import ExecutionParameters

Tree = dict[str, Any]

SECTIONS: dict[str, type] = {
    "object": ObjectParameters,
    "scene": SceneParameters,
    "camera": CameraParameters,
    "stations": StationParameters,
    "silhouette": SilhouetteParameters,
    "surface": SurfaceParameters,
    "hand": HandParameters,
    "planner": PlannerParameters,
    "quality": QualityParameters,
    "search": SearchParameters,
    "execution": ExecutionParameters,
    "record": RecordParameters,
}


def section_type(section: str, content: Mapping[str, Any]) -> type:
    """Return the dataclass of a section; for ``index`` that of the index it names."""
    if section == "index":
        kind: type = INDICES[str(content.get("name"))].parameters
        return kind
    return SECTIONS[section]


def complete_with_defaults(tree: Mapping[str, Any]) -> Tree:
    """Fill a composed tree with the defaults of every section.

    Raises:
        ConfigurationError: A YAML file sets a section or key that does not exist.
    """
    complete: Tree = {"seed": int(tree.get("seed", 0))}
    for section in (*SECTIONS, "index"):
        content = dict(tree.get(section) or {})
        kind = section_type(section, content)
        name = {"name": content["name"]} if section == "index" else {}
        complete[section] = _merge(name | _defaults(kind), content, section)
    unknown = sorted(set(tree) - set(complete) - {"experiment"})
    if unknown:
        raise ConfigurationError(
            f"unknown configuration section '{unknown[0]}'", remedy=f"the sections are {', '.join(complete)}"
        )
    return complete


def validate_section(section: str, content: Mapping[str, Any]) -> Any:
    """Build a section's parameters from plain values.

    Raises:
        ConfigurationError: A value is of the wrong type or out of range; the message names the key.
    """
    kind = section_type(section, content)
    values = {key: value for key, value in content.items() if (section, key) != ("index", "name")}
    try:
        return TypeAdapter(kind).validate_python(values)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join([section, *(str(part) for part in first["loc"])])
        raise ConfigurationError(
            f"{key} = {first['input']!r} cannot be used",
            remedy=first["msg"][:1].lower() + first["msg"][1:],
            key=key,
            value=first["input"],
        ) from error


def _defaults(kind: type) -> Tree:
    return {key: _plain(value) for key, value in dataclasses.asdict(kind()).items()}


def _plain(value: Any) -> Any:
    """Turn tuples into lists, as YAML has them."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def _merge(defaults: Tree, content: Mapping[str, Any], where: str) -> Tree:
    merged = dict(defaults)
    for key, value in content.items():
        if key not in defaults:
            raise ConfigurationError(
                f"unknown option '{where}.{key}'", remedy=f"the options are {', '.join(defaults)}"
            )
        nested = isinstance(defaults[key], dict) and isinstance(value, Mapping) and defaults[key]
        merged[key] = _merge(defaults[key], value, f"{where}.{key}") if nested else _plain(value)
    return merged
