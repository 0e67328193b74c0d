"""Overrides in Hydra's grammar."""

import shlex
from collections.abc import Sequence
from functools import lru_cache

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import HydraException

from graspbench.errors import ConfigurationError

# The grammar's parser takes minutes for what is much longer, or nested much deeper.
MAX_CHARACTERS = 20_000
MAX_DEPTH = 50
_OPENING, _CLOSING = "([{", ")]}"
_MARKS = "=#'\""
_HOW_TO = "write key=value or group=option"


def parse_overrides(overrides: Sequence[str]) -> list[Override]:
    """Parse overrides.

    Raises:
        ConfigurationError: One cannot be read.
    """
    return [parse_override(text) for text in overrides]


def parse_override(text: str, remedy: str = _HOW_TO) -> Override:
    """Parse an override.

    Args:
        text: For example ``index.k_cm=0.5``.
        remedy: What to say to one that cannot be read.

    Raises:
        ConfigurationError: It cannot be read.
    """
    if len(text) > MAX_CHARACTERS or _depth(text) > MAX_DEPTH:
        raise ConfigurationError(
            f"the override '{text}' is too long or nested too deeply",
            remedy=f"at most {MAX_CHARACTERS} characters and {MAX_DEPTH} brackets in each other are read",
            override=text,
        )
    try:
        return _parsed(text)
    # Its grammar checks what a text looks like; a number of thousands of digits is found out by Python.
    except (HydraException, ValueError, RecursionError) as error:
        raise ConfigurationError(
            f"the override '{text}' cannot be read ({first_line(error)})",
            remedy=_quoted(text) or remedy,
            override=text,
        ) from error


def _quoted(text: str) -> str | None:
    """Return how to write an override whose value, such as a path, holds a mark of Hydra's grammar."""
    key, _, value = text.partition("=")
    if not key or not any(mark in value for mark in _MARKS) or any(mark in value for mark in _OPENING):
        return None
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    quoted = f'{key}="{escaped}"'
    try:
        _parser().parse_override(quoted)
    except (HydraException, ValueError, RecursionError):
        return None
    return f"quote the value: {shlex.quote(quoted)}"


@lru_cache(maxsize=8192)
def _parsed(text: str) -> Override:
    """Read an override; a sweep has each of its values in many trials. Nobody changes what is returned."""
    return _parser().parse_override(text)


@lru_cache(maxsize=1)
def _parser() -> OverridesParser:
    """Return the one parser: to make one takes as long as to read an override by it."""
    return OverridesParser.create()


def _depth(text: str) -> int:
    """Return how many brackets stand in each other at most, those inside quotes included."""
    depth = deepest = 0
    for character in text:
        if character in _OPENING:
            depth += 1
            deepest = max(deepest, depth)
        elif character in _CLOSING:
            depth -= 1
    return deepest


def first_line(error: Exception) -> str:
    """Return what an error says, without the lines that explain it."""
    return str(error).strip().splitlines()[0].rstrip(".") if str(error).strip() else type(error).__name__
