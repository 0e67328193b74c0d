"""One trial, from camera images to an executed grasp: the thesis' block diagram (figure 3.2)."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.errors import HandError
from graspbench.experiment.clock import StageClock
from graspbench.experiment.config import TrialConfig
from graspbench.experiment.results import (
    execution_result,
    global_result,
    local_result,
    ratios,
    reconstruction_result,
    smallest_width,
)
from graspbench.geometry import ObjectModel, load_object
from graspbench.hand import GraspChecker, HandModel, load_hand
from graspbench.perception import silhouettes as find_silhouettes
from graspbench.planning import (
    FingertipPath,
    GlobalResult,
    Index,
    JointPath,
    LocalPlan,
    fingertip_paths,
    make_index,
    plan_global,
    plan_local,
    track,
)
from graspbench.reconstruction import Surface, VisualHull, reconstruct
from graspbench.record import TrialLog
from graspbench.simulation import World
from graspbench.simulation.capture import capture
from graspbench.simulation.execute import execute


def run_trial(
    config: TrialConfig,
    *,
    log: TrialLog | None = None,
    picture_dir: Path | None = None,
    on_stage: Callable[[str, float], None] | None = None,
) -> dict[str, Any]:
    """Run one trial.

    Args:
        config: What to run.
        log: Where to record it; None records nothing.
        picture_dir: Where its pictures go; None draws none.
        on_stage: Called with each stage's name and seconds.

    Returns:
        The trial's part of ``result.json``: plain values only.

    Raises:
        InputError: What the configuration names cannot be used.
        TrialError: The trial failed on its way; the message says where and why.
    """
    clock = StageClock(on_stage)
    index = make_index(config.index_name, config.index, config.hand.fingers, config.quality)
    with clock.stage("hand"):
        hand = load_hand(config.hand)
        checker = GraspChecker(hand, 0.0 if config.surface.ground else None)
    with clock.stage("object"):
        model = load_object(config.object)
        _check_size(model, checker)
    with clock.stage("scene"):
        world = World(model, config.scene, config.seed)
    with world:
        with clock.stage("images"):
            views = capture(world, config.camera, config.stations, config.seed, config.silhouette)
        with clock.stage("silhouettes"):
            silhouettes = find_silhouettes(views, config.silhouette)

        surfaces: list[Surface] = []
        snapshots = clock.producing("reconstruction", reconstruct(silhouettes, config.surface), surfaces)
        plan = _plan_local(config, index, checker, snapshots, clock)
        final = surfaces[-1]
        globals_ = _plan_global(config, checker, final, clock)

        with clock.stage("paths"):
            paths, path = _paths(config, plan, hand)
        object_pose = world.transform_object_to_world
        execution = None
        if config.execution.until != "off":
            with clock.stage("execution"):
                execution = execute(world, hand, plan.grasp, path, config.execution)

    with clock.stage("figures of merit"):
        hull = VisualHull(silhouettes, config.surface.ground)
        local = local_result(plan)
        best = {measure: global_result(found) for measure, found in globals_.items()}
        result = {
            "success": execution is None or execution.success,
            "object": {"name": model.name, "mass_kg": model.mass_kg, "extents_m": model.mesh.extents},
            "local": local,
            "global": best,
            "ratio": ratios(local, best),
            "reconstruction": reconstruction_result(surfaces, hull, model, object_pose),
            "execution": None if execution is None else execution_result(execution),
        }
    if log is not None:
        with clock.stage("record"):
            log.views(views, silhouettes)
            log.object_pose(object_pose)
            for surface in surfaces:
                log.surface(surface)
            for measure, found in globals_.items():
                if found.grasp is not None:
                    log.grasp(found.grasp, f"global-{measure}")
            log.grasp(plan.grasp, "local")
            log.paths(paths)
            log.joints(hand.joint_names, path.times, path.joints, path.transform_palm_to_world)
            log.scores(_scores(result))
    if picture_dir is not None and config.record.pictures:
        with clock.stage("pictures"):
            from graspbench.experiment.pictures import draw_trial  # loads Matplotlib

            title = f"{model.name}, {hand.name} hand, {config.index_name}"
            draw_trial(picture_dir, title, local, views, silhouettes, surfaces, plan, paths)
    return {**result, "times_s": dict(clock.seconds)}


def _check_size(model: ObjectModel, checker: GraspChecker) -> None:
    """Refuse an object that no posture of the hand can span, before any image is taken."""
    width = smallest_width(np.asarray(model.mesh.vertices)) + 2 * checker.hand.tip_radius_m
    if width > checker.pair_limit_m:
        raise HandError(
            f"the object '{model.name}' with a fingertip on each side is {1e3 * width:.0f} mm wide where it is "
            f"narrowest, and the hand '{checker.hand.name}' spans {1e3 * checker.pair_limit_m:.0f} mm",
            remedy="take a larger hand or a smaller object.scale",
            width_m=width,
            span_m=checker.pair_limit_m,
        )


def _plan_local(
    config: TrialConfig,
    index: Index,
    checker: GraspChecker,
    snapshots: Iterable[Surface],
    clock: StageClock,
) -> LocalPlan:
    """Plan while the surface shrinks."""
    plan = plan_local(snapshots, index, checker, config.hand.fingers, config.planner, config.quality)
    clock.add("local_planning", plan.planning_time_s)
    return plan


def _paths(
    config: TrialConfig, plan: LocalPlan, hand: HandModel
) -> tuple[tuple[FingertipPath, ...], JointPath]:
    """Plan the fingertips' way to their contacts and the hand's motion along it."""
    planner, posture = config.planner, plan.grasp.posture
    assert posture is not None, "a plan made with a checker has a posture"
    paths = fingertip_paths(plan.history, planner.paths, planner.floating_distance_m, hand)
    return paths, track(paths, hand, posture, planner.paths)


def _plan_global(
    config: TrialConfig, checker: GraspChecker, surface: Surface, clock: StageClock
) -> dict[str, GlobalResult]:
    """Search the finished surface for the best grasp by each measure."""
    if not config.search.enabled:
        return {}
    centred = getattr(config.index, "k_cm", 0.0) > 0
    found = {}
    for measure in config.search.measures:
        with clock.stage(f"global_{measure}"):
            found[measure] = plan_global(
                surface,
                measure,
                config.hand.fingers,
                config.quality,
                config.search,
                checker=checker,
                centre_tolerance_m=0.01 if centred else None,
            )
    return found


def _scores(result: Mapping[str, Any]) -> dict[str, Any]:
    scores: dict[str, Any] = {"success": result["success"]}
    for measure in ("q1", "q2", "q3"):
        scores[f"local.{measure}"] = result["local"][measure]
        if measure in result["global"]:
            scores[f"global.{measure}"] = result["global"][measure]["value"]
            scores[f"ratio.{measure}"] = result["ratio"].get(measure)
    return scores
