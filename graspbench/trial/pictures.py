"""The pictures of a trial, drawn: loads Matplotlib."""

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspbench.compiled import seconds_compiling
from graspbench.report import draw_grasp, draw_surface_moments, draw_views, pick_moments, style
from graspbench.report.geometry import trial_geometry, write_geometry
from graspbench.report.hand_solids import hand_solids
from graspbench.report.loss_picture import draw_loss

if TYPE_CHECKING:  # only attributes are read: whoever draws need not load the stages
    from graspbench.record.parameters import RecordParameters
    from graspbench.simulation.execution_result import ExecutionResult
    from graspbench.trial.evidence import Evidence
    from graspbench.trial.planned import PlannedTrial
    from graspbench.trial.planned_pictures import PlannedPictures


def draw_seen(evidence: "Evidence", folder: Path, wanted: "RecordParameters") -> tuple[float, float]:
    """Draw what a grasp is planned on: the views, the surface's moments (thesis figures 3.3, 3.10).

    Args:
        evidence: What the trial came to.
        folder: Where ``views.png`` and ``surface.png`` go; made where it is missing.
        wanted: How they are drawn.

    Returns:
        Seconds of drawing, and seconds of compilation apart from them.
    """
    return _timed(lambda: _draw_evidence(folder, evidence), folder, wanted)


def draw_planned(pictures: "PlannedPictures", folder: Path) -> tuple[float, float]:
    """Draw the grasp with the paths to it, and the hand that holds it (thesis figure 3.11).

    Args:
        pictures: What they show.
        folder: Where ``grasp.png`` and ``hand.png`` go, and the geometry for the report's interactive view;
            made where it is missing.

    Returns:
        Seconds of drawing, and seconds of compilation apart from them.
    """
    return _timed(lambda: _draw(pictures, folder), folder, pictures.wanted)


def _timed(draw: Callable[[], object], folder: Path, wanted: "RecordParameters") -> tuple[float, float]:
    started, compiling = time.perf_counter(), seconds_compiling()
    folder.mkdir(exist_ok=True)
    with style.drawn_as(_look(wanted)):
        draw()
    spent = seconds_compiling() - compiling
    return time.perf_counter() - started - spent, spent


def draw_failure(
    folder: Path, trial: "PlannedTrial", execution: "ExecutionResult", wanted: "RecordParameters"
) -> None:
    """Draw ``loss.png`` into a folder where the execution failed.

    Args:
        folder: Where to.
        trial: The trial.
        execution: What came of it in physics.
        wanted: How it is drawn.
    """
    if trial.scene is None or execution.reason is None:
        return
    mesh = trial.scene.model.mesh
    with style.drawn_as(_look(wanted)):
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


def draw_evidence(folder: Path, evidence: "Evidence", wanted: "RecordParameters") -> None:
    """Draw what is known of a trial that found no grasp: its views, and its surface as far as there is one.

    Args:
        folder: Where ``views.png`` and ``surface.png`` go.
        evidence: What the trial came to.
        wanted: How they are drawn.
    """
    with style.drawn_as(dataclasses.replace(_look(wanted), titles=False)):
        _draw_evidence(folder, evidence)


def _draw_evidence(folder: Path, evidence: "Evidence") -> None:
    if evidence.views:
        draw_views(evidence.views, evidence.silhouettes, folder / "views.png")
    if evidence.surfaces:
        draw_surface_moments(pick_moments(evidence.surfaces), folder / "surface.png")


def _look(wanted: "RecordParameters") -> style.Look:
    return dataclasses.replace(style.PRINT if wanted.print else style.SCREEN, titles=wanted.titles)


def _draw(shown: "PlannedPictures", folder: Path) -> None:
    surface, grasp, quality = shown.surface, shown.grasp, shown.quality
    write_geometry(*trial_geometry(surface, grasp, shown.paths, shown.hand), folder)
    title = shown.title
    caption = f"Q1 {quality.q1:.3g}   Q2 {quality.q2:.3g}   Q3 {quality.q3:.3g}"
    draw_grasp(surface, grasp, shown.paths, folder / "grasp.png", title=title, caption=caption)
    if grasp.posture is not None:
        posture = grasp.posture
        solids = hand_solids(shown.hand, posture.joints, posture.transform_palm_to_world)
        draw_grasp(surface, grasp, (), folder / "hand.png", hand=solids, title=title, caption=caption)
