"""Which protocols grasps are tried by: the group ``protocol`` of ``graspbench evaluate``, and its stand.

A protocol is no part of a trial: grasps are evaluated after they were planned, by as many as one likes.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graspbench.config.side_group import option_content, option_names, parsed_value, validated
from graspbench.errors import ConfigurationError
from graspbench.evaluation.judge import JudgeParameters
from graspbench.evaluation.protocols.protocol import PROTOCOLS, GraspProtocol
from graspbench.simulation.stand_parameters import StandParameters

GROUP = "protocol"
SECTIONS: Mapping[str, type] = {"judge": JudgeParameters, "stand": StandParameters}
ALL, NONE = "all", "none"
DEFAULT = "six_forces"


@dataclass(frozen=True)
class EvaluationParameters:
    """How grasps are evaluated.

    Attributes:
        protocols: Protocols by the names of their options.
        judge: How grasps are judged without physics.
        stand: The physics in which they are tried.
    """

    protocols: Mapping[str, GraspProtocol]
    judge: JudgeParameters
    stand: StandParameters


def split_evaluation(overrides: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the overrides of protocol, judge and stand, and those of hand, object and quality."""
    ours = [text for text in overrides if _section(text) in (GROUP, *SECTIONS)]
    return ours, [text for text in overrides if text not in ours]


def protocol_names(config_dir: Path | None = None) -> tuple[str, ...]:
    """Return all options of the group: those of files, and protocols of plug-ins that have none."""
    return tuple(sorted({*option_names(GROUP, config_dir), *PROTOCOLS.names()}))


def load_evaluation(overrides: Sequence[str] = (), config_dir: Path | None = None) -> EvaluationParameters:
    """Compose and validate how grasps are evaluated.

    Args:
        overrides: For example ``["protocol=six_forces,resist", "protocol.mass_kg=0.2"]``; a key of
            ``protocol`` goes to every protocol that has it, and ``protocol.lift.mass_kg`` to one only.
        config_dir: A user's folder that may hold further options ``protocol/<name>.yaml``.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    chosen = [DEFAULT]
    values: dict[str, Any] = {}
    for text in overrides:
        if text.startswith(f"{GROUP}="):
            chosen = [name for name in text.partition("=")[2].strip("[] ").split(",") if name]
        else:
            key, value = parsed_value(text, _section(text))
            values[key] = value
    if chosen == [ALL]:
        chosen = list(PROTOCOLS.names())
    elif chosen == [NONE]:
        chosen = []
    sections: dict[str, Any] = {
        name: validated(kind, _of_section(values, name), name) for name, kind in SECTIONS.items()
    }
    given = _of_section(values, GROUP)
    protocols = {name: _protocol(name.strip(), given, config_dir) for name in chosen}
    _check_used(given, protocols)
    return EvaluationParameters(protocols=protocols, **sections)


def _section(text: str) -> str:
    return text.split("=", 1)[0].split(".", 1)[0]


def _of_section(values: Mapping[str, Any], section: str) -> dict[str, Any]:
    start = f"{section}."
    return {key.removeprefix(start): value for key, value in values.items() if key.startswith(start)}


def _protocol(option: str, given: Mapping[str, Any], config_dir: Path | None) -> GraspProtocol:
    content: dict[str, Any] = {"name": option}
    if option in option_names(GROUP, config_dir) or option not in PROTOCOLS.names():
        if option not in protocol_names(config_dir):
            raise ConfigurationError(
                f"unknown protocol '{option}'",
                remedy=f"choose from {', '.join((*protocol_names(config_dir), ALL, NONE))}",
            )
        content |= option_content(GROUP, option, config_dir)
    kind = PROTOCOLS[str(content.pop("name"))]
    own = {field.name for field in dataclasses.fields(kind)}  # type: ignore[arg-type]
    content |= {key: value for key, value in given.items() if key in own}
    start = f"{option}."
    content |= {key.removeprefix(start): value for key, value in given.items() if key.startswith(start)}
    return validated(kind, content, f"{GROUP}.{option}")


def _check_used(given: Mapping[str, Any], protocols: Mapping[str, GraspProtocol]) -> None:
    known = {field.name for each in protocols.values() for field in dataclasses.fields(each)}  # type: ignore[arg-type]
    for key in given:
        if key not in known and key.split(".", 1)[0] not in protocols:
            raise ConfigurationError(
                f"no protocol that was chosen has an option '{key}'",
                remedy=f"choose one of {', '.join(sorted(known))}" if known else "choose a protocol",
            )
