"""From the stages' dataclasses to the plain values of ``result.json``."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from graspbench.arrays import FloatArray
from graspbench.geometry import ObjectModel
from graspbench.geometry.distance import distances_to_mesh
from graspbench.grasp import Grasp
from graspbench.planning import GlobalResult, LocalPlan
from graspbench.reconstruction import Surface, VisualHull
from graspbench.simulation.execution import ExecutionResult


def local_result(plan: LocalPlan) -> dict[str, Any]:
    """Return the local planner's grasp and how it was found."""
    left_out = {"grasp", "history", "quality", "initial"}
    counts = {
        field.name: getattr(plan, field.name)
        for field in dataclasses.fields(plan)
        if field.name not in left_out
    }
    return {**_grasp(plan.grasp), **plan.quality._asdict(), **counts}


def global_result(found: GlobalResult) -> dict[str, Any]:
    """Return the global optimum of one measure and its certificate."""
    values = {
        field.name: getattr(found, field.name) for field in dataclasses.fields(found) if field.name != "grasp"
    }
    return {**values, **(_grasp(found.grasp) if found.grasp is not None else {})}


def ratios(local: Mapping[str, Any], best: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    """Return local over global for each measure that was searched."""
    return {measure: local[measure] / found["value"] for measure, found in best.items() if found["value"] > 0}


def reconstruction_result(
    surfaces: Sequence[Surface], hull: VisualHull, model: ObjectModel, object_pose: FloatArray
) -> dict[str, Any]:
    """Return how well the surface at rest meets the visual hull and the object itself."""
    final = surfaces[-1]
    to_hull = np.abs(hull.signed_distance(final.points))
    in_object = (final.points - object_pose[:3, 3]) @ object_pose[:3, :3]
    to_mesh = distances_to_mesh(in_object, model.mesh)
    return {
        "nodes": len(final.points),
        "snapshots": len(surfaces),
        "iterations": final.iteration,
        "hull_mean_mm": 1e3 * float(to_hull.mean()),
        "hull_max_mm": 1e3 * float(to_hull.max()),
        "mesh_mean_mm": 1e3 * float(to_mesh.mean()),
        "mesh_max_mm": 1e3 * float(to_mesh.max()),
    }


def execution_result(execution: ExecutionResult) -> dict[str, Any]:
    """Return what came of the execution; the sampled motion is left to the log."""
    result = {
        field.name: getattr(execution, field.name)
        for field in dataclasses.fields(execution)
        if field.name not in {"motion", "phases"}
    }
    phases = {phase.name: dataclasses.asdict(phase) for phase in execution.phases}
    return {**result, "phases": phases, "largest_push_weight": execution.largest_push_weight}


def smallest_width(points: FloatArray) -> float:
    """Return the width of a point set in the direction in which it is narrowest, m.

    The narrowest direction of a convex polyhedron is a face normal or normal to two edges; the faces alone
    are close enough to tell an object from a hand's span.
    """
    hull = ConvexHull(points)
    extents = points[hull.vertices] @ np.unique(hull.equations[:, :3].round(9), axis=0).T
    return float((extents.max(axis=0) - extents.min(axis=0)).min())


def _grasp(grasp: Grasp) -> dict[str, Any]:
    pairs = zip(grasp.vertices, grasp.points, grasp.normals, strict=True)
    return {
        "contacts": [
            {"vertex": int(vertex), "point": point, "normal": normal} for vertex, point, normal in pairs
        ],
        "centroid": grasp.centroid,
        "posture": None if grasp.posture is None else dataclasses.asdict(grasp.posture),
    }
