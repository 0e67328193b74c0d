"""Overrides in Hydra's grammar."""

from collections.abc import Sequence

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import HydraException

from graspbench.errors import ConfigurationError


def parse_overrides(overrides: Sequence[str]) -> list[Override]:
    """Parse overrides.

    Raises:
        ConfigurationError: One cannot be read.
    """
    parser = OverridesParser.create()
    parsed = []
    for text in overrides:
        try:
            parsed.append(parser.parse_override(text))
        except HydraException as error:
            raise ConfigurationError(
                f"the override '{text}' cannot be read ({first_line(error)})",
                remedy="write key=value or group=option",
                override=text,
            ) from error
    return parsed


def first_line(error: Exception) -> str:
    """Return what an error says, without the lines that explain it."""
    return str(error).strip().splitlines()[0].rstrip(".") if str(error).strip() else type(error).__name__
