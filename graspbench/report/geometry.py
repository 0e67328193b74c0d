"""The geometry of a trial for the report's interactive view: surface, contacts, paths and hand, small.

The file has one JSON document a line: first the trial, then the arrays that it shares with others of its
kind (the network's faces, the hand's links), each as ``{"<name>": <array>}`` with a name made of its content.
So a page of thousands of trials takes the first lines as they are and every shared array once.
"""

import base64
import hashlib
import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NotRequired

import numpy as np
from pydantic import Field, StringConstraints, TypeAdapter
from typing_extensions import TypedDict

from graspbench.arrays import FloatArray

if TYPE_CHECKING:  # only attributes are read: no need to load the stages
    from graspbench.grasp.configuration import Grasp
    from graspbench.hand.model import HandModel
    from graspbench.planning.trajectory import FingertipPath
    from graspbench.reconstruction.surface import Surface

GEOMETRY_FILE = "geometry.jsonl"
_SCHEMA = 1
_LEVELS = 2**16 - 1
_PATH_POINTS = 24
_NAME_LENGTH = 12
_MAX_BYTES = 5_000_000

_Number = Annotated[float, Field(allow_inf_nan=False)]
_Point = Annotated[list[_Number], Field(min_length=3, max_length=3)]
_Array = Annotated[str, StringConstraints(pattern="^[A-Za-z0-9+/=]*$")]
_Name = Annotated[str, StringConstraints(pattern=f"^[0-9a-f]{{{_NAME_LENGTH}}}$")]


class _Packed(TypedDict):
    low: _Point
    step: _Point
    data: _Array


class _Mesh(TypedDict):
    role: Literal["surface", "hand"]
    points: _Packed | _Name
    faces: _Name
    pose: NotRequired[list[list[_Number]]]


class _Contact(TypedDict):
    point: _Point
    normal: _Point


class _Path(TypedDict):
    via: list[_Point]
    approach: list[_Point]
    grasp: list[_Point]


class _Geometry(TypedDict):
    schema: int
    meshes: list[_Mesh]
    contacts: list[_Contact]
    centroid: _Point
    paths: list[_Path]
    ground_m: _Number


@cache
def _geometry_adapter() -> TypeAdapter[_Geometry]:
    return TypeAdapter(_Geometry)


@cache
def _array_adapter() -> TypeAdapter[dict[str, _Array | _Packed]]:
    return TypeAdapter(dict[str, _Array | _Packed])


def trial_geometry(
    surface: "Surface",
    grasp: "Grasp",
    paths: "Sequence[FingertipPath]" = (),
    hand: "HandModel | None" = None,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a trial's geometry as plain values, about 70 kB as JSON.

    Points are stored as 16-bit steps of their bounding box: the error is below 0.01 mm for objects that a
    hand can grasp.

    Args:
        surface: The surface at rest.
        grasp: The local planner's grasp.
        paths: The fingertips' paths.
        hand: The hand, drawn in the grasp's posture; None draws none.

    Returns:
        The trial: ``meshes`` (role, points, faces, pose), ``contacts`` (point, outward normal), ``centroid``,
        ``paths`` and ``ground_m``, lengths in m, in the world. Then the shared arrays by name; in a mesh
        the name stands for the array.
    """
    shared: dict[str, Any] = {}
    faces = _share(shared, _text(np.asarray(surface.network.faces).astype("<u2")))
    meshes: list[dict[str, Any]] = [{"role": "surface", "points": _packed(surface.points), "faces": faces}]
    if hand is not None and grasp.posture is not None:
        from graspbench.report.hand_solids import placed_solids  # loads the hand's libraries

        posture = grasp.posture
        for solid, pose in placed_solids(hand, posture.joints, posture.transform_palm_to_world):
            points = _share(shared, _packed(solid.points))
            faces = _share(shared, _text(np.asarray(solid.faces).astype("<u2")))
            rows = [_rounded(row, 6) for row in pose[:3]]
            meshes.append({"role": "hand", "points": points, "faces": faces, "pose": rows})
    trial = {
        "schema": _SCHEMA,
        "meshes": meshes,
        "contacts": [
            {"point": _rounded(point), "normal": _rounded(normal)}
            for point, normal in zip(grasp.points, grasp.normals, strict=True)
        ],
        "centroid": _rounded(grasp.centroid),
        "paths": [
            {
                "via": [_rounded(point) for point in path.via],
                "approach": [_rounded(point) for point in _thinned(path.approach)],
                "grasp": [_rounded(point) for point in _thinned(path.grasp)],
            }
            for path in paths
        ],
        "ground_m": 0.0,
    }
    return trial, shared


def write_geometry(trial: dict[str, Any], shared: dict[str, Any], folder: Path) -> Path:
    """Write a trial's geometry into its folder."""
    documents = [trial, *({name: array} for name, array in shared.items())]
    path = folder / GEOMETRY_FILE
    lines = [json.dumps(document, separators=(",", ":")) for document in documents]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def read_geometry(path: Path, shared: dict[str, Any]) -> dict[str, Any] | None:
    """Return a stored geometry, and add the arrays it needs to ``shared``; None if there is none.

    The file may come from anybody: a link, a file that is too large, and one that does not hold what
    `write_geometry` writes are as if there were none. An array is taken only under the name that its
    content gives it, so no trial can change another's.
    """
    if path.is_symlink() or not path.is_file() or path.stat().st_size > _MAX_BYTES:
        return None
    try:
        first, *others = path.read_text(encoding="utf-8").splitlines()
        trial = _geometry_adapter().validate_json(first)
        arrays: dict[str, Any] = {}
        for line in others:
            if line[2 : 2 + _NAME_LENGTH] not in shared:
                arrays |= _array_adapter().validate_json(line)
    except (OSError, ValueError, RecursionError):
        return None
    wanted = {
        name for mesh in trial["meshes"] for name in (mesh["points"], mesh["faces"]) if isinstance(name, str)
    }
    named = {name: array for name, array in arrays.items() if _name_of(array) == name}
    if not wanted <= shared.keys() | named.keys():
        return None
    shared.update(named)
    return dict(trial)


def unpack_points(packed: dict[str, Any]) -> FloatArray:
    """Return the points of a stored mesh, shape (n, 3)."""
    steps = np.frombuffer(base64.b64decode(packed["data"]), dtype="<u2").reshape(-1, 3)
    points: FloatArray = np.asarray(packed["low"]) + steps * np.asarray(packed["step"])
    return points


def _share(shared: dict[str, Any], array: Any) -> str:
    name = _name_of(array)
    shared[name] = array
    return name


def _name_of(array: Any) -> str:
    return hashlib.sha256(json.dumps(array).encode()).hexdigest()[:_NAME_LENGTH]


def _packed(points: FloatArray) -> dict[str, Any]:
    low = points.min(axis=0)
    step = np.maximum(np.ptp(points, axis=0), 1e-9) / _LEVELS
    steps = np.round((points - low) / step).astype("<u2")
    return {"low": _rounded(low, 9), "step": step.tolist(), "data": _text(steps)}


def _text(array: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")


def _rounded(values: FloatArray, digits: int = 5) -> list[float]:
    return [round(float(value), digits) for value in values]


def _thinned(points: FloatArray) -> FloatArray:
    """Return at most a few points of a path, its ends among them."""
    keep = np.unique(np.linspace(0, len(points) - 1, min(len(points), _PATH_POINTS)).round().astype(int))
    return np.asarray(points[keep])
