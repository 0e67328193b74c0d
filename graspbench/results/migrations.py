"""Results of older versions, brought to the present schema when they are read.

A step takes a result of one version and returns it as the next version has it. Files are never rewritten.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from graspbench.errors import LogError

Result = dict[str, Any]

SCHEMA_VERSION = 2


def migrate(result: Any, path: Path) -> Result:
    """Return a result in the present schema.

    Args:
        result: What ``result.json`` holds.
        path: The file, for messages.

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
        result = _STEPS[result["schema"]](result)
    return dict(result)


def _from_1(result: Result) -> Result:
    """Version 2 says what kind of trial it was, and when and where it started."""
    provenance = {"host": None, "started": None, "seconds": None, **result.get("provenance", {})}
    kind = "manipulation" if "motion" in result else "trial"
    return {**result, "schema": 2, "kind": result.get("kind", kind), "provenance": provenance}


_STEPS: dict[int, Callable[[Result], Result]] = {1: _from_1}
