"""The typed schema of a trial's configuration: every section, its parameters and their defaults.

Each section is the frozen dataclass of parameters of the stage that reads it, so that a key is written
once: in the stage. The sections ``index`` and ``planner`` take the parameters of what they name. A primary
configuration (a file of ``conf/``) says which sections there are: ``config`` has those of a trial,
``manipulate`` three more.
"""

import dataclasses
from collections.abc import Mapping
from functools import cache, reduce
from importlib import import_module
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from graspbench.config.bounds import check_bounds
from graspbench.errors import ConfigurationError, shown
from graspbench.geometry import ObjectParameters
from graspbench.grasp import QualityParameters
from graspbench.hand import HandParameters
from graspbench.perception import CameraParameters, SilhouetteParameters, StationParameters
from graspbench.planning import INDICES, AnyPlannerParameters, SearchParameters
from graspbench.planning.planner import PLANNERS
from graspbench.reconstruction import SurfaceParameters
from graspbench.record import RecordParameters
from graspbench.registry import Registry
from graspbench.simulation import SceneParameters
from graspbench.simulation.arm_parameters import ArmParameters
from graspbench.simulation.execution_parameters import ExecutionParameters

Tree = dict[str, Any]
Primary = Literal["config", "manipulate"]

SECTIONS: dict[str, type] = {
    "object": ObjectParameters,
    "scene": SceneParameters,
    "camera": CameraParameters,
    "stations": StationParameters,
    "silhouette": SilhouetteParameters,
    "surface": SurfaceParameters,
    "hand": HandParameters,
    "arm": ArmParameters,
    "planner": AnyPlannerParameters,
    "quality": QualityParameters,
    "search": SearchParameters,
    "execution": ExecutionParameters,
    "record": RecordParameters,
}

# By module and name: only manipulation loads its solvers.
MANIPULATION_SECTIONS = {
    "clik": ("graspbench.manipulation.clik", "ClikParameters"),
    "motion": ("graspbench.manipulation.motion", "MotionParameters"),
    "contact": ("graspbench.manipulation.contact_parameters", "ContactParameters"),
}

# Sections that take the parameters of the plug-in they name, each with the name where none is given.
PLUGGED: dict[str, tuple[Registry[Any], str | None]] = {
    "index": (INDICES, None),
    "planner": (PLANNERS, "parallel"),
}

# What a configuration may hold besides: where its values come from, and the grids of an experiment.
NOT_SECTIONS = ("choice", "overridden", "experiment", "grids")

# Options that have moved, and what to write instead.
MOVED = {
    "execution.mount": "leave it out for a hand that floats, or choose an arm with arm=NAME, say arm=kuka"
}

# A mapping whose keys the user chooses: the names of tasks.
TASKS_KEY = "clik.tasks"


def section_names(primary: Primary = "config") -> tuple[str, ...]:
    """Return the sections of a primary configuration."""
    more = tuple(MANIPULATION_SECTIONS) if primary == "manipulate" else ()
    return (*SECTIONS, "index", *more)


def section_type(section: str, content: Mapping[str, Any]) -> type:
    """Return the dataclass of a section; for ``index`` and ``planner`` that of what it names."""
    if section in PLUGGED:
        kind: type = PLUGGED[section][0][plugged_name(section, content)].parameters
        return kind
    if section in MANIPULATION_SECTIONS:
        module, name = MANIPULATION_SECTIONS[section]
        parameters: type = getattr(import_module(module), name)
        return parameters
    return SECTIONS[section]


def plugged_name(section: str, content: Mapping[str, Any]) -> str:
    """Return which plug-in a section of `PLUGGED` names."""
    return str(content.get("name", PLUGGED[section][1]))


def complete_with_defaults(tree: Mapping[str, Any], primary: Primary = "config") -> Tree:
    """Fill a composed tree with the defaults of every section, and of every secondary task.

    Raises:
        ConfigurationError: A YAML file sets a section or key that does not exist.
    """
    complete: Tree = {"seed": tree.get("seed", 0)}
    for section in section_names(primary):
        content = _mapping(tree.get(section), section)
        kind = section_type(section, content)
        name = {"name": plugged_name(section, content)} if section in PLUGGED else {}
        complete[section] = _merge(name | _defaults(kind), content, section)
    if "clik" in complete:
        tasks = _mapping(complete["clik"]["tasks"], TASKS_KEY)
        complete["clik"]["tasks"] = complete_tasks(tasks)
    unknown = sorted({str(key) for key in tree} - set(complete) - {*NOT_SECTIONS})
    if unknown:
        raise ConfigurationError(
            f"unknown configuration section '{unknown[0]}'", remedy=f"the sections are {', '.join(complete)}"
        )
    return complete


def refuse_moved(key: str) -> None:
    """Say what to write instead of an option that has moved.

    Raises:
        ConfigurationError: The option has moved.
    """
    if key in MOVED:
        raise ConfigurationError(f"the option '{key}' is now the group 'arm'", remedy=MOVED[key], key=key)


def _mapping(content: Any, section: str) -> Tree:
    if content is None:
        return {}
    if not isinstance(content, Mapping):
        raise ConfigurationError(
            f"the section '{section}' is no mapping of options but {shown(content)}",
            remedy=f"write its options below it, or 'override /{section}: NAME' among the defaults",
        )
    return {str(key): value for key, value in content.items()}


def follow(tree: Tree) -> Tree:
    """Return a complete tree in which each null that stands for another key's value has that value."""
    followed = {f"search.{key}": f"index.{key}" for key in ("phi_cei_deg", "phi_eegi_deg")}
    if "clik" in tree:
        from graspbench.manipulation import TASKS

        for name, options in tree["clik"]["tasks"].items():
            for key, source in TASKS[str(options.get("kind", name))].FOLLOWS.items():
                followed[f"{TASKS_KEY}.{name}.{key}"] = source
    for key, source in followed.items():
        *parents, last = key.split(".")
        node = reduce(lambda inner, parent: inner[parent], parents, tree)
        section, _, name = source.partition(".")
        if node[last] is None:
            node[last] = tree[section].get(name)
    return tree


def complete_tasks(tasks: Mapping[str, Any]) -> Tree:
    """Return the secondary tasks of a configuration with every option of theirs, in the order given.

    Raises:
        ConfigurationError: A task is unknown, or an option of it is unknown or cannot be used.
    """
    from graspbench.manipulation import build_tasks

    given = {name: _mapping(options, f"{TASKS_KEY}.{name}") for name, options in tasks.items()}
    complete = {}
    for name, task in build_tasks(given).items():
        kind = {"kind": given[name]["kind"]} if "kind" in given[name] else {}
        complete[name] = kind | {key: _plain(value) for key, value in dataclasses.asdict(task).items()}
    return {name: complete[name] for name in given}


def validate_section(section: str, content: Mapping[str, Any]) -> Any:
    """Build a section's parameters from plain values.

    Raises:
        ConfigurationError: A value is of the wrong type or out of range; the message names the key.
    """
    kind = section_type(section, content)
    values = {key: value for key, value in content.items() if section not in PLUGGED or key != "name"}
    try:
        parameters = _adapter(kind).validate_python(values)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join([section, *(str(part) for part in first["loc"])])
        raise ConfigurationError(
            f"{key} = {shown(first['input'])} cannot be used",
            remedy=first["msg"][:1].lower() + first["msg"][1:],
            key=key,
            value=first["input"],
        ) from error
    check_bounds(section, parameters)
    return parameters


@cache
def _adapter(kind: type) -> TypeAdapter[Any]:
    """Return what validates a dataclass; to make one takes longer than to use it a hundred times."""
    return TypeAdapter(kind)


def _defaults(kind: type) -> Tree:
    """Return a section's defaults, in containers of the caller's own."""
    return {key: _plain(value) for key, value in _known_defaults(kind).items()}


@cache
def _known_defaults(kind: type) -> Tree:
    return dataclasses.asdict(kind())


def _plain(value: Any) -> Any:
    """Turn tuples into lists, as YAML has them; a copy."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def _merge(defaults: Tree, content: Mapping[str, Any], where: str) -> Tree:
    merged = dict(defaults)
    for key, value in content.items():
        if key not in defaults:
            refuse_moved(f"{where}.{key}")
            raise ConfigurationError(
                f"unknown option '{where}.{key}'", remedy=f"the options are {', '.join(defaults)}"
            )
        nested = isinstance(defaults[key], dict) and isinstance(value, Mapping) and defaults[key]
        merged[key] = _merge(defaults[key], value, f"{where}.{key}") if nested else _plain(value)
    return merged
