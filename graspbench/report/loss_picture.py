"""A picture of how a grasp lost its object: hand and object at a few moments, as seen from the palm."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.report import style
from graspbench.report.figures import travel_viewpoint
from graspbench.report.hand_solids import hand_solids
from graspbench.report.render import render
from graspbench.report.solids import ball, mesh_solid

if TYPE_CHECKING:  # pictures only read attributes: no need to load the stages
    from graspbench.grasp.configuration import Grasp
    from graspbench.hand.model import HandModel
    from graspbench.simulation.execution_result import Motion

_TILE = 380
_FIRST_DRIFT_M, _LOST_M = 0.002, 0.02
"""How far the object's centre moves in the palm when it begins to go, and when it is gone."""

_SAME_S = 0.05
_MARK_M = 0.004


class Moment(NamedTuple):
    """A sample worth a picture.

    Attributes:
        sample: Its place in the motion.
        label: What is to be seen then.
    """

    sample: int
    label: str


def loss_moments(motion: Motion, contact_times_s: Sequence[float]) -> tuple[Moment, ...]:
    """Choose the moments that show how an object was lost.

    They are the last first touch, the last sample before the object's centre has moved 2 mm in the palm, the
    first one after it has moved 20 mm, and the end; those that are less than 0.05 s apart or did not come
    are left out.

    Args:
        motion: Samples of the execution.
        contact_times_s: When each finger touched, nan if it did not, shape (n_f,).
    """
    times = motion.times_s
    end = len(times) - 1
    touched = np.asarray(contact_times_s, dtype=np.float64)
    touched = touched[np.isfinite(touched)]
    first = int(np.searchsorted(times, touched.max())) if len(touched) else end
    first = min(first, end)
    way = object_drift(motion, first)
    chosen = [Moment(first, "the last finger to touch has touched")]
    for limit, before, label in (
        (_FIRST_DRIFT_M, 1, "before the object moves in the hand"),
        (_LOST_M, 0, f"it has moved {1e3 * _LOST_M:.0f} mm"),
    ):
        beyond = np.flatnonzero(way[first:] > limit)
        if len(beyond):
            chosen.append(Moment(max(first + int(beyond[0]) - before, first), label))
    chosen.append(Moment(end, "the end"))
    kept = chosen[:1]
    for moment in chosen[1:]:
        if times[moment.sample] - times[kept[-1].sample] >= _SAME_S:
            kept.append(moment)
    return tuple(kept)


def object_drift(motion: Motion, since: int) -> FloatArray:
    """Return how far the object's centre is from where it was at a sample, in the palm (m), shape (t,)."""
    palms = np.linalg.inv(motion.transform_palm_to_world)
    centres = (palms @ motion.transform_object_to_world)[:, :3, 3]
    drift: FloatArray = np.linalg.norm(centres - centres[since], axis=1)
    return drift


def draw_loss(
    vertices: FloatArray,
    faces: IntArray,
    hand: HandModel,
    grasp: Grasp,
    motion: Motion,
    contact_times_s: Sequence[float],
    reason: str,
    path: Path,
) -> Path:
    """Draw hand and object at the moments in which the object was lost; the palm stands still in the picture.

    Args:
        vertices: The object's, in its own frame, shape (n, 3).
        faces: Its triangles, shape (m, 3).
        hand: The hand.
        grasp: As planned; its contacts are marked and stay with the object.
        motion: Samples of the execution.
        contact_times_s: When each finger touched, nan if it did not, shape (n_f,).
        reason: Why the grasp failed, one clause.
        path: PNG file to write.
    """
    moments = loss_moments(motion, contact_times_s)
    start = moments[0].sample
    palm = motion.transform_palm_to_world[start]
    marks = _moved(grasp.points, np.linalg.inv(motion.transform_object_to_world[0]))
    held = [solid.points for solid in hand_solids(hand, motion.joints[start], palm)]
    body = _moved(vertices, motion.transform_object_to_world[start])
    view = travel_viewpoint(np.concatenate((body, *held)), grasp)
    foot = 62
    figure = style.canvas(_TILE * len(moments), _TILE + foot)
    for k, moment in enumerate(moments):
        s = moment.sample
        # The palm is taken back to where it was at the first moment, the object with it.
        pose = palm @ np.linalg.inv(motion.transform_palm_to_world[s]) @ motion.transform_object_to_world[s]
        solids = [
            mesh_solid(_moved(vertices, pose), faces, style.SURFACE),
            *hand_solids(hand, motion.joints[s], palm),
        ]
        points = [ball(point, _MARK_M, style.CONTACT) for point in _moved(marks, pose)]
        image = render(solids, points, view, (_TILE, _TILE))
        style.place(figure, image, k * _TILE, 0, (_TILE, _TILE))
        text = f"{motion.times_s[s]:.2f} s: {moment.label}"
        style.write(figure, text, (k + 0.5) * _TILE, _TILE + 4, 11, ha="center")
    style.write(figure, f"{reason}; red: the planned contacts", 18, _TILE + 32, 12, weight="bold")
    return style.save(figure, path)


def _moved(points: FloatArray, pose: FloatArray) -> FloatArray:
    moved: FloatArray = points @ pose[:3, :3].T + pose[:3, 3]
    return moved
