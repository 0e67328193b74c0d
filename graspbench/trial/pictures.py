"""The pictures of a trial."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from graspbench.planning import FingertipPath
from graspbench.report import draw_grasp, draw_surface_moments, draw_views, pick_moments, style
from graspbench.report.geometry import trial_geometry, write_geometry
from graspbench.report.hand_solids import hand_solids
from graspbench.report.loss_picture import draw_loss
from graspbench.simulation.execution_result import ExecutionResult
from graspbench.trial.planned import Evidence, PlannedTrial


def draw_trial(
    folder: Path,
    index: str,
    trial: PlannedTrial,
    paths: Sequence[FingertipPath],
    execution: ExecutionResult | None,
    *,
    for_print: bool = False,
    titles: bool = False,
) -> None:
    """Draw the views, the surface's moments, the paths, and the hand (thesis figures 3.3, 3.10, 3.11).

    Args:
        folder: Where ``views.png``, ``surface.png``, ``grasp.png`` and ``hand.png`` go, ``loss.png`` where
            the execution failed, and the geometry for the report's interactive view.
        index: The index's name.
        trial: The trial.
        paths: Its fingertip paths.
        execution: What came of them in physics; None if nothing was executed.
        for_print: Whether PDF and SVG are written too, and everything at 300 dots an inch.
        titles: Whether a title and the measures stand in the pictures.
    """
    look = dataclasses.replace(style.PRINT if for_print else style.SCREEN, titles=titles)
    with style.drawn_as(look):
        _draw(folder, index, trial, paths)
        if execution is not None and trial.scene is not None and execution.reason is not None:
            mesh = trial.scene.model.mesh
            draw_loss(
                np.asarray(mesh.vertices),
                np.asarray(mesh.faces),
                trial.hand,
                trial.executed.grasp,
                execution.motion,
                execution.contact_time_s,
                execution.reason,
                folder / "loss.png",
            )


def draw_evidence(folder: Path, evidence: Evidence, *, for_print: bool = False) -> None:
    """Draw what is known of a trial that found no grasp: its views, and its surface as far as there is one.

    Args:
        folder: Where ``views.png`` and ``surface.png`` go.
        evidence: What the trial came to.
        for_print: As for `draw_trial`.
    """
    with style.drawn_as(style.PRINT if for_print else style.SCREEN):
        if evidence.views:
            draw_views(evidence.views, evidence.silhouettes, folder / "views.png")
        if evidence.surfaces:
            draw_surface_moments(pick_moments(evidence.surfaces), folder / "surface.png")


def _draw(folder: Path, index: str, trial: PlannedTrial, paths: Sequence[FingertipPath]) -> None:
    draw_views(trial.views, trial.silhouettes, folder / "views.png")
    draw_surface_moments(pick_moments(trial.surfaces), folder / "surface.png")
    surface, grasp, quality = trial.surfaces[-1], trial.executed.grasp, trial.executed.quality
    write_geometry(*trial_geometry(surface, grasp, paths, trial.hand), folder)
    title = f"{trial.name}, {trial.hand.name} hand, {index}"
    caption = f"Q1 {quality.q1:.3g}   Q2 {quality.q2:.3g}   Q3 {quality.q3:.3g}"
    draw_grasp(surface, grasp, paths, folder / "grasp.png", title=title, caption=caption)
    if grasp.posture is not None:
        posture = grasp.posture
        solids = hand_solids(trial.hand, posture.joints, posture.transform_palm_to_world)
        draw_grasp(surface, grasp, (), folder / "hand.png", hand=solids, title=title, caption=caption)
