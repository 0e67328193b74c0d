"""Objects loaded: from the catalogue, a mesh file or a folder of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.errors import ConfigurationError
from graspbench.geometry.body import Body
from graspbench.geometry.catalogue import CatalogueEntry, catalogue_entry, read_entry
from graspbench.geometry.decomposition import convex_parts
from graspbench.geometry.files import load_body
from graspbench.geometry.folders import pick_from_folder
from graspbench.geometry.frames import rotation_to_z
from graspbench.geometry.inspection import inspect
from graspbench.geometry.mesh import make_mesh, mass_properties, moved
from graspbench.geometry.model import ObjectModel
from graspbench.geometry.naming import mesh_name
from graspbench.geometry.object_parameters import FILE_CHOICES, YCB, ObjectParameters
from graspbench.geometry.shapes import make_shape
from graspbench.geometry.ycb import ycb_facts

_NAMES_OF_NOTHING = (ObjectParameters.name, *FILE_CHOICES)
"""Names that a configuration has without anybody having chosen them for a mesh file."""

_USER_ENTRY = CatalogueEntry(
    name="mesh", description="A mesh file", shape={}, licence="as its owner says", source="user's file"
)


def load_object(parameters: ObjectParameters) -> ObjectModel:
    """Return the object that the parameters describe.

    Raises:
        ConfigurationError: A name or parameter is unknown or out of range.
        MeshError: A mesh cannot be used; the sentence says why.
    """
    entry, name, body = _find(parameters)
    turn = rotation_to_z(parameters.up) @ rotation_to_z(entry.up)
    vertices, faces, report = inspect(
        np.asarray(body.mesh.vertices) @ turn.T, np.asarray(body.mesh.faces), name, trusted=True
    )
    report = replace(
        report, repairs=(*body.repairs, *report.repairs), warnings=(*body.warnings, *report.warnings)
    )
    if not report.usable:
        raise report.error()
    volume, centre, _ = mass_properties(vertices, faces)
    from_file = np.eye(4)
    from_file[:3, :3], from_file[:3, 3] = turn, -centre
    if body.parts is None:
        parts = convex_parts(make_mesh(vertices - centre, faces))
    else:
        parts = tuple(moved(part, turn, -centre) for part in body.parts)
    return ObjectModel(
        name=name,
        mesh=make_mesh(vertices - centre, faces),
        collision_parts=parts,
        mass_kg=_mass_kg(parameters, entry, volume),
        friction=entry.friction if parameters.friction is None else parameters.friction,
        rgba=entry.rgba if parameters.rgba is None else parameters.rgba,
        yaw_deg=parameters.yaw_deg,
        licence=entry.licence,
        source=entry.source,
        report=report,
        transform_file_to_object=from_file,
    )


def _mass_kg(parameters: ObjectParameters, entry: CatalogueEntry, volume_m3: float) -> float:
    """Return the mass: what is asked for comes before what is known, a mass before a density."""
    for asked_or_known in (parameters, entry):
        if asked_or_known.mass_kg is not None:
            return asked_or_known.mass_kg
        if asked_or_known.density_kg_m3 is not None:
            return asked_or_known.density_kg_m3 * volume_m3
    return volume_m3 * CatalogueEntry.density_kg_m3


def _find(parameters: ObjectParameters) -> tuple[CatalogueEntry, str, Body]:
    if parameters.mesh is not None:
        path = Path(parameters.mesh).expanduser()
        body = load_body(path, parameters.scale, parameters.repair)
        return replace(_USER_ENTRY, source=str(path)), object_name(parameters), body
    if parameters.folder is not None:
        item = pick_from_folder(Path(parameters.folder).expanduser(), parameters.id)
        of_ycb = item.ycb or parameters.name == YCB
        # Scans are never clean: what the YCB set distributes is meant to be repaired.
        body = load_body(item.path, parameters.scale, parameters.repair or of_ycb)
        entry = replace(_USER_ENTRY, source=str(item.path))
        return _known_entry(entry, item.name, body) if of_ycb else (entry, item.name, body)
    if parameters.name in FILE_CHOICES and parameters.entry is None:
        key = "mesh" if parameters.name == "mesh" else "folder"
        raise ConfigurationError(f"object={parameters.name} needs a path", remedy=f"set object.{key}=PATH")
    entry, name = _entry(parameters), object_name(parameters)
    description = {**entry.shape, **parameters.shape}
    if parameters.id is not None:
        if "id" not in entry.shape:
            raise ConfigurationError(f"object '{entry.name}' is not a family", remedy="leave object.id empty")
        description["id"] = parameters.id
    if parameters.scale == "guess":
        raise ConfigurationError(
            f"object.scale=guess with '{name}', whose size is known",
            remedy="guess the unit of mesh files only",
        )
    body = _build(_frozen(description))
    return entry, name, body if parameters.scale == 1.0 else _scaled(body, parameters.scale)


def object_name(parameters: ObjectParameters) -> str:
    """Return what the object is called, or will be once it can be loaded.

    Raises:
        ConfigurationError: A catalogue entry of the user's cannot be read.
        MeshError: There is no such folder, or no such mesh in it.
    """
    if parameters.mesh is not None:
        given = parameters.name not in _NAMES_OF_NOTHING
        return parameters.name if given else mesh_name(Path(parameters.mesh).expanduser())
    if parameters.folder is not None:
        return pick_from_folder(Path(parameters.folder).expanduser(), parameters.id).name
    entry = _entry(parameters)
    which = entry.shape.get("id") if parameters.id is None else parameters.id
    return entry.name if which is None else f"{entry.name}_{which}"


def _entry(parameters: ObjectParameters) -> CatalogueEntry:
    return catalogue_entry(parameters.name) if parameters.entry is None else read_entry(parameters.entry)


def _known_entry(entry: CatalogueEntry, name: str, body: Body) -> tuple[CatalogueEntry, str, Body]:
    """Complete the entry of a mesh of the YCB set by what is known of the object."""
    facts = ycb_facts(name)
    if facts.mass_kg is None:
        warning = f"the mass of {name} is in no table, so that it has {entry.density_kg_m3:g} kg/m^3"
        body = replace(body, warnings=(*body.warnings, warning))
    known = replace(entry, mass_kg=facts.mass_kg, friction=facts.friction, licence=facts.licence)
    return known, name, body


def _scaled(body: Body, factor: float) -> Body:
    linear = factor * np.eye(3)
    parts = None if body.parts is None else tuple(moved(part, linear) for part in body.parts)
    return replace(body, mesh=moved(body.mesh, linear), parts=parts)


@lru_cache(maxsize=64)
def _build(description: Any) -> Body:
    return make_shape(_thawed(description)).build()


def _frozen(value: Any) -> Any:
    """Return a hashable twin of a description, so that shapes are built once per process."""
    if isinstance(value, Mapping):
        return ("mapping", tuple((str(key), _frozen(item)) for key, item in value.items()))
    if isinstance(value, list | tuple):
        return ("list", tuple(_frozen(item) for item in value))
    return value


def _thawed(value: Any) -> Any:
    match value:
        case ("mapping", items):
            return {key: _thawed(item) for key, item in items}
        case ("list", items):
            return [_thawed(item) for item in items]
    return value
