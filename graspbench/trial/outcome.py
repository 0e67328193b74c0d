"""From the stages' dataclasses to a trial's typed result."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import trimesh

from graspbench.geometry.distance import distances_to_mesh
from graspbench.grasp import Grasp, QualityParameters
from graspbench.grasp.distance import diversity_m
from graspbench.grasp.measure import evaluate_measures
from graspbench.planning import GlobalResult, LocalPlan, Plan, RefinedGrasp, SearchParameters
from graspbench.planning.global_search import outer_triangle_m2
from graspbench.reconstruction import Surface
from graspbench.results.about import picked
from graspbench.results.grasp_results import (
    ContactResult,
    ExploredResult,
    FormedResult,
    GlobalGraspResult,
    LocalResult,
    PlannedResult,
    PostureResult,
    RefinedGraspResult,
    RestartedResult,
    StrengthenedResult,
)
from graspbench.results.physical_results import ExecutedResult, PhaseResult, StepResult
from graspbench.results.trial_result import ObjectResult, ReconstructionResult
from graspbench.simulation.execution_result import ExecutionResult, PhaseOutcome

if TYPE_CHECKING:
    from graspbench.trial.planned import PlannedTrial


def local_result(
    trial: "PlannedTrial", quality: QualityParameters | None = None, search: SearchParameters | None = None
) -> LocalResult:
    """Return the planner's grasp and how it was found.

    Args:
        trial: The planned trial.
        quality: Asks for further measures; None for none.
        search: Says which measures are searched for; None for none.
    """
    plan, last = trial.plan, trial.surfaces[-1]
    found: LocalResult = picked(
        LocalResult,
        PlannedResult,
        plan,
        plan.details,
        **_grasp(plan.grasp),
        **plan.quality._asdict(),
        **_verification(trial, plan.grasp),
        formed={} if plan.details is None else _formed(plan.details),
        mirtich_canny=None if search is None else _outer_triangle(plan.grasp, search),
        measures={} if quality is None else _measures(plan.grasp, last, quality),
    )
    return found


def planned_result(name: str, plan: Plan) -> PlannedResult:
    """Return which planner planned, and when its grasps came."""
    diversity = diversity_m([timed.found.grasp.points for timed in plan.found])
    return PlannedResult(
        planner=name,
        grasps=len(plan.found),
        first_s=plan.first_s,
        best_s=plan.best_s,
        diversity_mm=None if diversity is None else 1e3 * diversity,
    )


def restarted_result(plan: LocalPlan) -> RestartedResult:
    """Return the grasp of the multi-start on the finished surface."""
    found: RestartedResult = picked(
        RestartedResult, plan, **_grasp(plan.grasp), **plan.quality._asdict(), measures={}
    )
    return found


def strengthened_result(trial: "PlannedTrial", quality: QualityParameters) -> StrengthenedResult | None:
    """Return the grasp that is executed in place of the planned one; None where that is executed."""
    instead = trial.strengthened
    if instead is None:
        return None
    found: StrengthenedResult = picked(
        StrengthenedResult,
        instead,
        **_grasp(instead.grasp),
        **instead.quality._asdict(),
        **_verification(trial, instead.grasp),
        measures=_measures(instead.grasp, trial.surfaces[-1], quality),
    )
    return found


def explored_result(trial: "PlannedTrial") -> ExploredResult | None:
    """Return what exploring grasps felt, and the one that is executed; None where none was made."""
    found = trial.explored
    if found is None:
        return None
    told: ExploredResult = picked(
        ExploredResult,
        found,
        **_grasp(found.grasp),
        **found.quality._asdict(),
        **_verification(trial, found.grasp),
        grasps=len(found.felt),
        value=found.felt[found.best],
        first=found.felt[0],
    )
    return told


_FORMED = (0.5, 0.8, 1.0)


def _formed(plan: LocalPlan) -> dict[str, FormedResult]:
    """Return how good the best grasp was when the surface was formed half, to four fifths, and wholly."""
    found = {}
    for share in _FORMED:
        reached = [step for step in plan.steps if step.formed >= share - 1e-9]
        if reached:
            step = reached[0]
            found[f"{100 * share:.0f}"] = FormedResult(**step.quality._asdict(), followers=step.followers)
    return found


def global_results(
    best: Mapping[str, GlobalResult], surface: Surface, quality: QualityParameters
) -> dict[str, GlobalGraspResult]:
    """Return the best grasp by each measure, with its certificate."""
    return {
        measure: picked(
            GlobalGraspResult, found, **_grasp(found.grasp), measures=_measures(found.grasp, surface, quality)
        )
        for measure, found in best.items()
    }


def refined_results(refined: Mapping[str, RefinedGrasp]) -> dict[str, RefinedGraspResult]:
    """Return the grasp to which each measure was climbed from the local one, and how it was found."""
    return {
        measure: picked(RefinedGraspResult, found, **_grasp(found.grasp))
        for measure, found in refined.items()
    }


def ratios(local: LocalResult, best: Mapping[str, GlobalGraspResult]) -> dict[str, float]:
    """Return local over global for each measure that was searched and that is known of both grasps."""
    return {
        measure: local[measure] / found.value
        for measure, found in best.items()
        if local[measure] is not None and found.value > 0
    }


def object_result(trial: "PlannedTrial") -> ObjectResult:
    """Return what the object is; its mass and size when it was simulated."""
    if trial.scene is None:
        return ObjectResult(trial.name)
    model = trial.scene.model
    return ObjectResult(model.name, model.mass_kg, tuple(model.mesh.extents.tolist()))


def reconstruction_result(trial: "PlannedTrial") -> ReconstructionResult:
    """Return how far the surface came, and its distance to the object itself when that is known."""
    final = trial.surfaces[-1]
    mean_mm = max_mm = None
    if trial.scene is not None:
        pose = trial.scene.transform_object_to_world
        to_mesh = distances_to_mesh((final.points - pose[:3, 3]) @ pose[:3, :3], trial.scene.model.mesh)
        mean_mm, max_mm = 1e3 * float(to_mesh.mean()), 1e3 * float(to_mesh.max())
    return ReconstructionResult(
        len(final.points), len(trial.surfaces), final.iteration, final.network.genus, mean_mm, max_mm
    )


def execution_result(execution: ExecutionResult) -> ExecutedResult:
    """Return what came of the execution; the sampled motion is left to the log."""
    steps = {kind: picked(StepResult, step) for kind, step in execution.steps.items()}
    found: ExecutedResult = picked(
        ExecutedResult, execution, phases=phase_results(execution.phases), steps=steps
    )
    return found


def phase_results(phases: tuple[PhaseOutcome, ...]) -> dict[str, PhaseResult]:
    """Return how each phase ended, by its name."""
    return {phase.name: picked(PhaseResult, phase) for phase in phases}


def _verification(trial: "PlannedTrial", grasp: Grasp) -> dict[str, Any]:
    """Return whether a grasp's posture stands before an independent check, and what is wrong if not.

    The check is `GraspChecker.verify`: fingertips, joint limits, singular values, and collisions of the
    whole collision shapes with the hand itself, the ground and the reconstructed surface.
    """
    last = trial.surfaces[-1]
    if grasp.posture is None:
        return {}
    body = trimesh.Trimesh(last.points, last.network.faces, process=False)
    violations = trial.checker.verify(grasp.posture, grasp.points, grasp.normals, body)
    return {"verified": not violations, "violations": tuple(violations)}


def _outer_triangle(grasp: Grasp, search: SearchParameters) -> float | None:
    """Return the area of a grasp's outer triangle if that is searched for, by the criterion searched for."""
    wanted = search.enabled and "mirtich_canny" in search.measures
    return outer_triangle_m2(grasp, search) if wanted else None


def _measures(grasp: Grasp | None, surface: Surface, quality: QualityParameters) -> dict[str, float]:
    """Return the further measures of a grasp that the configuration asks for."""
    if grasp is None or not quality.measures:
        return {}
    torque_length_m = quality.torque_length_m(surface.points, surface.centroid)
    values = evaluate_measures(
        quality.measures, grasp.points, -grasp.normals, surface.centroid, quality, torque_length_m
    )
    return {name: float(value) for name, value in values.items()}


def _grasp(grasp: Grasp | None) -> dict[str, Any]:
    if grasp is None:
        return {}
    pairs = zip(grasp.vertices, grasp.points, grasp.normals, strict=True)
    return {
        "contacts": tuple(
            ContactResult(int(vertex), tuple(point.tolist()), tuple(normal.tolist()))
            for vertex, point, normal in pairs
        ),
        "centroid": tuple(grasp.centroid.tolist()),
        "posture": None if grasp.posture is None else picked(PostureResult, grasp.posture),
    }
