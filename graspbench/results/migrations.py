"""Results of older versions, brought to the present schema when they are read.

A step takes a result of one version and returns it as the next version has it. Files are never rewritten.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from graspbench.errors import ConfigurationError, LogError
from graspbench.yaml_files import read_yaml

Result = dict[str, Any]

SCHEMA_VERSION = 3
_CONFIG_FILE = "config.yaml"


def migrate(result: Any, path: Path) -> Result:
    """Return a result in the present schema.

    Args:
        result: What ``result.json`` holds.
        path: The file, for messages and for the configuration beside it.

    Raises:
        LogError: It is no result, or one of a newer version.
    """
    schema = result.get("schema") if isinstance(result, dict) else None
    if not isinstance(schema, int) or not (schema in _STEPS or schema == SCHEMA_VERSION):
        raise LogError(
            f"the result {path} has schema {schema!r}, this version reads {min(_STEPS)} to {SCHEMA_VERSION}",
            remedy="use the version of graspbench that wrote it",
            path=path,
        )
    while result["schema"] != SCHEMA_VERSION:
        result = _STEPS[result["schema"]](result, path)
    return dict(result)


def _from_1(result: Result, _path: Path) -> Result:
    """Version 2 says what kind of trial it was, and when and where it started."""
    provenance = {"host": None, "started": None, "seconds": None, **(result.get("provenance") or {})}
    kind = "manipulation" if "motion" in result else "trial"
    return {**result, "schema": 2, "kind": result.get("kind", kind), "provenance": provenance}


def _from_2(result: Result, path: Path) -> Result:
    """Version 3 holds the configuration, and calls a success only what was executed."""
    config = _config_beside(path)
    for key in ("stations", "motion"):
        if isinstance(result.get(key), dict):
            config.setdefault(key, result[key])
    more: Result = {"schema": 3, "config": config, "choice": {}, "overridden": []}
    if result.get("kind") == "manipulation":
        config.setdefault("contact", {"kind": result.get("contact")})
        config.setdefault("clik", {"method": result.get("method")})
    elif result.get("execution") is None and result.get("status") == "done":
        more["success"] = None
    if isinstance(result.get("global"), dict):
        more["global"] = _up_to_solver(result["global"])
    return {**result, **more}


def _up_to_solver(optima: Result) -> Result:
    """Before version 3 what the posture solver refused counted as excluded: the bounds were up to it."""
    return {
        measure: {
            **found,
            "upper_bound": None,
            "gap": None,
            "optimal": False,
            "upper_bound_up_to_solver": found.get("upper_bound"),
            "optimal_up_to_solver": found.get("optimal", False),
            "doubtful": None,
        }
        for measure, found in optima.items()
    }


def _config_beside(path: Path) -> Result:
    try:
        content = read_yaml(path.parent / _CONFIG_FILE)
    except ConfigurationError:
        return {}
    return content if isinstance(content, dict) else {}


_STEPS: dict[int, Callable[[Result, Path], Result]] = {1: _from_1, 2: _from_2}
