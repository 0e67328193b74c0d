"""From the stages' dataclasses to the plain values of ``result.json``."""

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import trimesh

from graspbench.geometry.distance import distances_to_mesh
from graspbench.grasp import Grasp, QualityParameters
from graspbench.grasp.measure import evaluate_measures
from graspbench.planning import GlobalResult, LocalPlan, RefinedGrasp
from graspbench.reconstruction import Surface
from graspbench.simulation.execution import ExecutionResult

if TYPE_CHECKING:
    from graspbench.trial.planned import PlannedTrial


def local_result(plan: LocalPlan) -> dict[str, Any]:
    """Return the local planner's grasp and how it was found."""
    left_out = {"grasp", "history", "quality", "initial"}
    counts = {
        field.name: getattr(plan, field.name)
        for field in dataclasses.fields(plan)
        if field.name not in left_out
    }
    return {**_grasp(plan.grasp), **plan.quality._asdict(), **counts}


def verified_result(trial: "PlannedTrial") -> dict[str, Any]:
    """Return whether the local grasp's posture stands before an independent check, and what is wrong if not.

    The check is `GraspChecker.verify`: fingertips, joint limits, singular values, and collisions of the
    whole collision shapes with the hand itself, the ground and the reconstructed surface.
    """
    grasp, last = trial.plan.grasp, trial.surfaces[-1]
    if grasp.posture is None:
        return {}
    body = trimesh.Trimesh(last.points, last.network.faces, process=False)
    violations = trial.checker.verify(grasp.posture, grasp.points, grasp.normals, body)
    return {"verified": not violations, "violations": list(violations)}


def global_result(found: GlobalResult) -> dict[str, Any]:
    """Return the global optimum of one measure and its certificate."""
    values = {
        field.name: getattr(found, field.name) for field in dataclasses.fields(found) if field.name != "grasp"
    }
    return {**values, **(_grasp(found.grasp) if found.grasp is not None else {})}


def refined_result(found: RefinedGrasp) -> dict[str, Any]:
    """Return the grasp to which one measure was climbed from the local one, and how it was found."""
    left_out = {"grasp", "measure"}
    values = {
        field.name: getattr(found, field.name)
        for field in dataclasses.fields(found)
        if field.name not in left_out
    }
    return {**values, **_grasp(found.grasp)}


def measures_result(grasp: Grasp | None, surface: Surface, quality: QualityParameters) -> dict[str, Any]:
    """Return the further measures of a grasp that the configuration asks for; nothing if it asks for none."""
    if grasp is None or not quality.measures:
        return {}
    torque_length_m = quality.torque_length_m(surface.points, surface.centroid)
    values = evaluate_measures(
        quality.measures, grasp.points, -grasp.normals, surface.centroid, quality, torque_length_m
    )
    return {"measures": {name: float(value) for name, value in values.items()}}


def ratios(local: Mapping[str, Any], best: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    """Return local over global for each measure that was searched."""
    return {measure: local[measure] / found["value"] for measure, found in best.items() if found["value"] > 0}


def object_result(trial: "PlannedTrial") -> dict[str, Any]:
    """Return what the object is; its mass and size when it was simulated."""
    if trial.scene is None:
        return {"name": trial.name}
    model = trial.scene.model
    return {"name": model.name, "mass_kg": model.mass_kg, "extents_m": model.mesh.extents}


def reconstruction_result(trial: "PlannedTrial") -> dict[str, Any]:
    """Return how far the surface came, and its distance to the object itself when that is known."""
    final = trial.surfaces[-1]
    result: dict[str, Any] = {
        "nodes": len(final.points),
        "snapshots": len(trial.surfaces),
        "iterations": final.iteration,
        "genus": final.network.genus,
    }
    if trial.scene is not None:
        pose = trial.scene.transform_object_to_world
        to_mesh = distances_to_mesh((final.points - pose[:3, 3]) @ pose[:3, :3], trial.scene.model.mesh)
        result["mesh_mean_mm"] = 1e3 * float(to_mesh.mean())
        result["mesh_max_mm"] = 1e3 * float(to_mesh.max())
    return result


def execution_result(execution: ExecutionResult) -> dict[str, Any]:
    """Return what came of the execution; the sampled motion is left to the log."""
    result = {
        field.name: getattr(execution, field.name)
        for field in dataclasses.fields(execution)
        if field.name not in {"motion", "phases"}
    }
    phases = {phase.name: dataclasses.asdict(phase) for phase in execution.phases}
    return {**result, "phases": phases, "largest_push_weight": execution.largest_push_weight}


def _grasp(grasp: Grasp) -> dict[str, Any]:
    pairs = zip(grasp.vertices, grasp.points, grasp.normals, strict=True)
    return {
        "contacts": [
            {"vertex": int(vertex), "point": point, "normal": normal} for vertex, point, normal in pairs
        ],
        "centroid": grasp.centroid,
        "posture": None if grasp.posture is None else dataclasses.asdict(grasp.posture),
    }
