"""The catalogue: one YAML file per object, with a shape and what else a trial must know about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from graspbench.datasets import catalogue_files
from graspbench.errors import ConfigurationError
from graspbench.geometry.frames import Axis
from graspbench.geometry.object_parameters import Colour
from graspbench.geometry.shapes.registry import describe_first
from graspbench.yaml_files import check_plain, read_yaml


@dataclass(frozen=True)
class CatalogueEntry:
    """One YAML file of the catalogue: a shape and what else a trial must know about the object."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    name: Annotated[str, Field(min_length=1, description="What the object is called; the file's stem")]
    description: Annotated[str, Field(description="One line for readers")]
    shape: Annotated[dict[str, Any], Field(description="kind and parameters of the shape")]
    licence: Annotated[str, Field(description="Licence of the shape")]
    source: Annotated[str, Field(description="Where the shape comes from")]
    up: Annotated[Axis, Field(description="The shape's axis that points up when the object lies at rest")] = (
        "z"
    )
    density_kg_m3: Annotated[float, Field(gt=0, description="Density, kg/m^3")] = 250.0
    mass_kg: Annotated[float | None, Field(gt=0, description="Mass instead of a density, kg")] = None
    friction: Annotated[float, Field(ge=0, description="Coulomb friction coefficient")] = 0.5
    rgba: Annotated[Colour, Field(description="Red, green, blue and opacity, each 0 to 1")] = (
        0.85,
        0.45,
        0.15,
        1.0,
    )


def list_objects() -> tuple[str, ...]:
    """Return the names of the catalogue, sorted."""
    return tuple(catalogue_files())


def catalogue_entry(name: str) -> CatalogueEntry:
    """Return the catalogue's entry of this name.

    Raises:
        ConfigurationError: There is none; the message lists those there are.
    """
    entries = catalogue_files()
    if name not in entries:
        raise ConfigurationError(
            f"unknown object '{name}'",
            remedy=f"choose one of {', '.join(entries)}, or set object.mesh",
        )
    return _as_entry(read_yaml(entries[name]), f"{name}.yaml")


def read_entry(path: str | Path) -> CatalogueEntry:
    """Return a catalogue entry from a YAML file of the user's.

    Raises:
        ConfigurationError: The file is missing or is not an entry.
    """
    return _as_entry(read_yaml(Path(path).expanduser()), str(path))


@lru_cache(maxsize=1)
def _entry_adapter() -> TypeAdapter[CatalogueEntry]:
    """Return what validates an entry; to make one takes longer than to use it."""
    return TypeAdapter(CatalogueEntry)


def _as_entry(content: Any, where: str) -> CatalogueEntry:
    check_plain(content, where)
    if not isinstance(content, Mapping):
        raise ConfigurationError(
            f"{where} is not a catalogue entry", remedy="give a mapping with name and shape"
        )
    try:
        return _entry_adapter().validate_python({str(k): v for k, v in content.items()})
    except ValidationError as error:
        raise ConfigurationError(
            f"{where}: {describe_first(error)}", remedy="correct the catalogue entry"
        ) from None
