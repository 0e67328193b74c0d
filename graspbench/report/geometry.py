"""The geometry of a trial for the report's interactive view: surface, contacts, paths and hand, small."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspbench.arrays import FloatArray, IntArray

if TYPE_CHECKING:  # only attributes are read: no need to load the stages
    from graspbench.grasp.configuration import Grasp
    from graspbench.hand.model import HandModel
    from graspbench.planning.trajectory import FingertipPath
    from graspbench.reconstruction.surface import Surface

GEOMETRY_FILE = "geometry.json"
_SCHEMA = 1
_LEVELS = 2**16 - 1
_PATH_POINTS = 24


def trial_geometry(
    surface: Surface, grasp: Grasp, paths: Sequence[FingertipPath] = (), hand: HandModel | None = None
) -> dict[str, Any]:
    """Return a trial's geometry as plain values, about 70 kB as JSON.

    Points are stored as 16-bit steps of their bounding box: the error is below 0.01 mm for objects that a
    hand can grasp.

    Args:
        surface: The surface at rest.
        grasp: The local planner's grasp.
        paths: The fingertips' paths.
        hand: The hand, drawn in the grasp's posture; None draws none.

    Returns:
        ``shapes`` (points, faces), ``meshes`` (role, number of the shape, pose), ``contacts`` (point, outward
        normal), ``centroid``, ``paths`` and ``ground_m``. Lengths in m, in the world.
    """
    shapes = [_shape(surface.points, surface.network.faces)]
    meshes: list[dict[str, Any]] = [{"role": "surface", "shape": 0}]
    if hand is not None and grasp.posture is not None:
        from graspbench.report.hand_solids import placed_solids  # loads the hand's libraries

        posture = grasp.posture
        for solid, pose in placed_solids(hand, posture.joints, posture.transform_palm_to_world):
            shape = _shape(solid.points, solid.faces)
            if shape not in shapes:  # fingers are alike
                shapes.append(shape)
            rows = [_rounded(row, 6) for row in pose[:3]]
            meshes.append({"role": "hand", "shape": shapes.index(shape), "pose": rows})
    return {
        "schema": _SCHEMA,
        "shapes": shapes,
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


def write_geometry(geometry: dict[str, Any], folder: Path) -> Path:
    """Write a trial's geometry into its folder."""
    import json

    path = folder / GEOMETRY_FILE
    path.write_text(json.dumps(geometry, separators=(",", ":")), encoding="utf-8")
    return path


def unpack_points(packed: dict[str, Any]) -> FloatArray:
    """Return the points of a stored mesh, shape (n, 3)."""
    steps = np.frombuffer(base64.b64decode(packed["data"]), dtype="<u2").reshape(-1, 3)
    points: FloatArray = np.asarray(packed["low"]) + steps * np.asarray(packed["step"])
    return points


def _shape(points: FloatArray, faces: IntArray) -> dict[str, Any]:
    low = points.min(axis=0)
    step = np.maximum(np.ptp(points, axis=0), 1e-9) / _LEVELS
    data = np.round((points - low) / step).astype("<u2")
    return {
        "points": {"low": _rounded(low, 9), "step": step.tolist(), "data": _text(data)},
        "faces": _text(np.asarray(faces).astype("<u2")),
    }


def _text(array: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")


def _rounded(values: FloatArray, digits: int = 5) -> list[float]:
    return [round(float(value), digits) for value in values]


def _thinned(points: FloatArray) -> FloatArray:
    """Return at most a few points of a path, its ends among them."""
    keep = np.unique(np.linspace(0, len(points) - 1, min(len(points), _PATH_POINTS)).round().astype(int))
    return np.asarray(points[keep])
