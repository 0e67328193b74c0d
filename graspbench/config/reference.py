"""The configuration reference, written from the typed schema itself."""

import dataclasses
import types
import typing
from collections.abc import Iterator
from typing import Any, Literal, Union

import yaml
from pydantic.fields import FieldInfo

from graspbench.config.bounds import bounds_of, fields_of, is_whole
from graspbench.config.engine import EngineParameters
from graspbench.config.groups import CONF_DIR, group_options
from graspbench.config.protocols import SECTIONS as EVALUATION_SECTIONS
from graspbench.config.schema import MANIPULATION_SECTIONS, PLUGGED, SECTIONS, section_type
from graspbench.evaluation.protocols.protocol import PROTOCOLS
from graspbench.geometry import catalogue_entry

_INTRODUCTION = """\
# Configuration

<!-- Written by `graspbench config --reference`; a test keeps it in step with the code. -->

Every option of a trial, by section. `graspbench run section=option` chooses a file of `conf/section/`,
`graspbench run section.key=value` sets one value. `seed` (default 0) is the source of every random draw.
"""


def configuration_reference() -> str:
    """Return all sections with their options, keys, types, defaults and meanings as Markdown."""
    groups = group_options(primary="manipulate")
    parts = [_INTRODUCTION]
    for section, kind in SECTIONS.items():
        parts.append(_section(section, kind, groups.get(section, ())))
    for section, (registry, _) in PLUGGED.items():
        for name in registry.names():
            kind = section_type(section, {"name": name})
            parts.append(_section(section, kind, (), f"{section}={name}", but=SECTIONS.get(section)))
    parts.append("## Manipulation\n\nThe further sections of `graspbench manipulate`.\n")
    for section in MANIPULATION_SECTIONS:
        parts.append(_section(section, section_type(section, {}), groups.get(section, ())))
    parts.append(
        "# Engine\n\nWhere the trials of `graspbench sweep` and `tune` are run; no part of a trial.\n"
    )
    engines = tuple(sorted(path.stem for path in (CONF_DIR / "engine").glob("*.yaml")))
    parts.append(_section("engine", EngineParameters, engines))
    parts.append("# Evaluation\n\nHow `graspbench evaluate` judges and tries grasps; no part of a trial.\n")
    for name in PROTOCOLS.names():
        parts.append(_section("protocol", PROTOCOLS[name], (), f"protocol={name}"))
    parts += [_section(name, kind, ()) for name, kind in EVALUATION_SECTIONS.items()]
    return "\n".join(parts)


def option_values() -> dict[str, tuple[str, ...]]:
    """Return the values of every key that has a few to choose from, as they are typed."""
    kinds = [(section, section_type(section, {})) for section in (*SECTIONS, *MANIPULATION_SECTIONS)]
    kinds += [
        (section, section_type(section, {"name": name}))
        for section, (registry, _) in PLUGGED.items()
        for name in registry.names()
    ]
    kinds += [("engine", EngineParameters)]
    found = {key: _choices(hint) for section, kind in kinds for key, _, hint, _ in _keys(kind, section)}
    return {key: values for key, values in sorted(found.items()) if values}


def _keys(kind: Any, prefix: str) -> Iterator[tuple[str, "dataclasses.Field[Any]", Any, FieldInfo | None]]:
    """Yield each key with its field, its type and what its field says, those of sections inside too."""
    for field, (_, hint, info) in zip(dataclasses.fields(kind), fields_of(kind), strict=True):
        key = f"{prefix}.{field.name}"
        if dataclasses.is_dataclass(hint):
            yield from _keys(hint, key)
        else:
            yield key, field, hint, info


def _choices(hint: Any) -> tuple[str, ...]:
    hint = _unwrapped(hint)
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is Literal:
        return tuple(str(item) for item in arguments)
    if hint is bool:
        return ("true", "false")
    if hint is type(None):
        return ("null",)
    if origin in (Union, types.UnionType):
        named = tuple(value for item in arguments for value in _choices(item))
        return named if named != ("null",) else ()
    return ()


def _section(
    section: str, kind: type, options: tuple[str, ...], title: str | None = None, but: type | None = None
) -> str:
    """Describe a section; keys that the dataclass ``but`` has stand in a section of their own."""
    lines = [f"## {title or section}", "", _first_line(kind), ""]
    if options:
        described = [_option(section, option) for option in options]
        lines += ["Options:", "", *described, ""]
    known = set() if but is None else set(_rows(but, section))
    rows = [row for row in _rows(kind, section) if row not in known]
    if rows:
        lines += ["| key | type | default | meaning |", "|---|---|---|---|", *rows, ""]
    return "\n".join(lines)


def _option(section: str, option: str) -> str:
    path = CONF_DIR / section / f"{option}.yaml"
    first = path.read_text(encoding="utf-8").splitlines()[:1] if path.is_file() else []
    comment = first[0].lstrip("# ") if first and first[0].startswith("#") else ""
    if section == "object" and not path.is_file():
        comment = f"{catalogue_entry(option).description}."
    return f"- `{section}={option}`" + (f": {comment}" if comment else "")


def _rows(kind: type, prefix: str) -> Iterator[str]:
    for key, (kind_of_value, meaning, default) in _described(kind, prefix):
        cells = [cell.replace("|", r"\|") for cell in (kind_of_value, meaning)]
        yield f"| `{key}` | {cells[0]} | `{default}` | {cells[1]} |"


def _described(kind: type, prefix: str) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """Yield each key with its type and bounds, its meaning and its default."""
    for key, field, hint, info in _keys(kind, prefix):
        bounds = ", ".join(str(item) for item in (*_bounds(info), *_unit_bounds(field.name, hint, info)))
        shown = f"{_type_name(hint)}{f', {bounds}' if bounds else ''}"
        yield key, (shown, info.description if info and info.description else "", _yaml(_default(field)))


def _unwrapped(hint: Any) -> Any:
    return typing.get_args(hint)[0] if typing.get_origin(hint) is typing.Annotated else hint


def _bounds(info: FieldInfo | None) -> Iterator[str]:
    signs = {"ge": "≥", "gt": ">", "le": "≤", "lt": "<"}
    for item in info.metadata if info else ():
        for name, sign in signs.items():
            if getattr(item, name, None) is not None:
                yield f"{sign} {getattr(item, name):g}"


def _unit_bounds(name: str, hint: Any, info: FieldInfo | None) -> Iterator[str]:
    """Yield the bounds that a number has by its unit, where its own field has none."""
    if not {int, float} & {hint, *typing.get_args(hint)}:
        return
    own, bounds = list(_bounds(info)), bounds_of(name, is_whole(hint), info)
    if not any(text[0] in "<≤" for text in own):
        unlimited_below = not any(text[0] in ">≥" for text in own)
        yield f"≤ {'±' if unlimited_below else ''}{bounds.high:g}"


def _type_name(hint: Any) -> str:
    hint = _unwrapped(hint)
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is Literal:
        return " or ".join(f"`{item}`" for item in arguments)
    if origin in (Union, types.UnionType):
        return " or ".join(_type_name(item) for item in arguments)
    if hint is type(None):
        return "null"
    if origin is not None:
        inner = [_type_name(item) for item in arguments if item is not Ellipsis]
        name = "mapping" if origin is dict else "list"
        return f"{name} of {', '.join(dict.fromkeys(inner))}" if inner else name
    return {"str": "text", "int": "whole number", "float": "number", "bool": "switch"}.get(
        getattr(hint, "__name__", str(hint)), getattr(hint, "__name__", str(hint))
    )


def _default(field: "dataclasses.Field[Any]") -> Any:
    if field.default is not dataclasses.MISSING:
        return field.default
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return None


def _yaml(value: Any) -> str:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = dataclasses.asdict(value)
    plain = _listed(value)
    text: str = yaml.safe_dump(plain, default_flow_style=True, width=10_000, allow_unicode=True)
    return text.removesuffix("\n...\n").strip()


def _listed(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _listed(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_listed(item) for item in value]
    return value if isinstance(value, str | int | float | bool | None) else str(value)


def _first_line(kind: type) -> str:
    return (kind.__doc__ or "").strip().split("\n\n")[0].replace("\n", " ")
