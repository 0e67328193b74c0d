"""Between a typed result and the plain values of its JSON."""

import dataclasses
import json
import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from graspbench.results.trial_result import TrialResult


def as_plain(value: Any) -> Any:
    """Turn dataclasses, arrays, tuples and paths into what JSON has; numbers that are not finite are null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name.rstrip("_"): as_plain(getattr(value, field.name))
            for field in dataclasses.fields(value)
        }
    if isinstance(value, Mapping):
        return {str(key): as_plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return as_plain(value.tolist())
    if isinstance(value, list | tuple):
        return [as_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Path):
        return str(value)
    return value


def to_json(value: Any) -> str:
    """Write strict JSON: numbers that are not finite become null."""
    return json.dumps(as_plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def result_from_plain(values: Mapping[str, Any]) -> TrialResult:
    """Build a typed result from the values of its JSON, of the present schema.

    Raises:
        ValueError: The values are no result; the message names the first that cannot be used.
    """
    named = {_FIELDS.get(key, key): value for key, value in values.items()}
    try:
        return _adapter().validate_python(named)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"{where}: {first['msg'][:1].lower()}{first['msg'][1:]}") from error


# JSON's names that Python does not allow as names of fields.
_FIELDS = {field.name.rstrip("_"): field.name for field in dataclasses.fields(TrialResult)}


@cache
def _adapter() -> TypeAdapter[TrialResult]:
    return TypeAdapter(TrialResult)
