"""A gait as one motion: turns and steps one after another."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from graspbench.arrays import BoolArray, FloatArray
from graspbench.manipulation.loop import ClikHistory
from graspbench.manipulation.manipulation_result import ManipulationResult


@dataclass(frozen=True, eq=False)
class StepTaken:
    """A step of one finger.

    Attributes:
        contact: Which contact of the grasp.
        finger: The finger's name.
        from_s: When it leaves the surface.
        to_s: When it is on it again.
        turned_deg: How far the object had turned.
    """

    contact: int
    finger: str
    from_s: float
    to_s: float
    turned_deg: float


@dataclass(frozen=True, eq=False)
class GaitResult(ManipulationResult):
    """A motion by finger gaiting; contacts of a finger that steps are NaN, its forces 0.

    Attributes:
        axis: What the object turns about, through its origin, palm frame, shape (3,).
        fingers: Finger of the hand at each contact.
        touching: Whether a finger is on the object, shape (t, n_c).
        turned_deg: How far the object has turned, shape (t,).
        turns: Number of turns between rounds of steps.
        steps: The steps in order of time.
    """

    axis: FloatArray
    fingers: tuple[int, ...]
    touching: BoolArray
    turned_deg: FloatArray
    turns: int
    steps: tuple[StepTaken, ...]


@dataclass(frozen=True, eq=False)
class Piece:
    """A turn or a step.

    Attributes:
        result: The motion, its times from 0.
        turned_deg: How far the object has turned, shape (t,).
        stepping: The contact whose finger steps; None in a turn.
    """

    result: ManipulationResult
    turned_deg: FloatArray
    stepping: int | None


def join(
    pieces: Sequence[Piece],
    axis: FloatArray,
    fingers: tuple[int, ...],
    names: Sequence[str],
    friction: float,
) -> GaitResult:
    """Return pieces as one motion; where one ends the next begins, and that sample is kept once.

    Args:
        pieces: One after another.
        axis: What the object turns about, palm frame, shape (3,).
        fingers: Finger of the hand at each contact.
        names: Their names.
        friction: Friction coefficient, for the margins that the forces leave.
    """
    results = [piece.result for piece in pieces]
    n_c = results[0].contact_points.shape[1]
    begins, steps, touching = [], [], []
    now = 0.0
    for piece in pieces:
        begins.append(now)
        times = piece.result.history.times
        on = np.ones((len(times), n_c), dtype=np.bool_)
        if piece.stepping is not None:
            on[1:-1, piece.stepping] = False
            name, turned = names[piece.stepping], float(piece.turned_deg[0])
            steps.append(StepTaken(piece.stepping, name, now, now + float(times[-1]), turned))
        touching.append(on)
        now += float(times[-1])
    firsts = [0 if k == 0 else 1 for k in range(len(pieces))]

    def stack(arrays: Sequence[Any]) -> Any:
        return np.concatenate([a[first:] for a, first in zip(arrays, firsts, strict=True)])

    history = {
        f.name: stack([getattr(r.history, f.name) for r in results])
        for f in fields(ClikHistory)
        if f.name not in ("times", "task_names")
    }
    times = stack([r.history.times + begin for r, begin in zip(results, begins, strict=True)])
    by_time: tuple[str, ...] = (
        "position_error_m",
        "rotation_error_deg",
        "contact_points",
        "contact_normals",
        "contact_drift_m",
        "transforms_object_to_palm",
        "desired_transforms_object_to_palm",
    )
    first = results[0]
    return GaitResult(
        history=ClikHistory(times=times, task_names=first.history.task_names, **history),
        joint_names=first.joint_names,
        grasp_class=first.grasp_class,
        transform_palm_to_world=first.transform_palm_to_world,
        force_times=np.concatenate([r.force_times + b for r, b in zip(results, begins, strict=True)]),
        **{name: stack([getattr(r, name) for r in results]) for name in by_time},
        forces=np.concatenate([r.forces for r in results]),
        torsions=np.concatenate([r.torsions for r in results]),
        force_margins=np.concatenate([_margins_n(r, friction) for r in results]),
        axis=axis,
        fingers=fingers,
        touching=stack(touching),
        turned_deg=stack([piece.turned_deg for piece in pieces]),
        turns=sum(piece.stepping is None for piece in pieces),
        steps=tuple(steps),
    )


def _margins_n(result: ManipulationResult, friction: float) -> FloatArray:
    """Return the smallest friction left at a contact that is pressed, at every time of the forces, N."""
    margins = np.empty(len(result.force_times))
    for k, (time, forces) in enumerate(zip(result.force_times, result.forces, strict=True)):
        at = min(int(np.searchsorted(result.history.times, time - 1e-9)), len(result.history.times) - 1)
        rotation = result.desired_transforms_object_to_palm[at, :3, :3]
        pressed = np.linalg.norm(forces, axis=1) > 0.0
        normals = result.contact_normals[at, pressed] @ rotation.T
        pressing = -np.einsum("ij,ij->i", forces[pressed], normals)
        sideways = np.linalg.norm(forces[pressed] + pressing[:, None] * normals, axis=1)
        margins[k] = float((friction * pressing - sideways).min())
    return margins
