"""The plan of what follows the contact: which phases there are, and how the palm moves in them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from graspbench.arrays import FloatArray, rotation_matrix
from graspbench.simulation.execution_parameters import ExecutionParameters
from graspbench.simulation.mounts.mount import PalmTask

TILT_DIRECTIONS = (1.0, -1.0)
_KEY_POSES = 10

PalmMotion = Callable[[float], FloatArray]
"""Pose of the palm, shape (4, 4), for the share of a phase's time that has gone by, 0 to 1."""


@dataclass(frozen=True)
class Phase:
    """One phase in which the palm carries the object.

    Attributes:
        name: lift, hold, rotate, hold_rotated, shake_x, shake_y or shake_z.
        motion: How the palm moves.
        time_s: How long it takes, s.
    """

    name: str
    motion: PalmMotion
    time_s: float


@dataclass(frozen=True)
class PhasePlan:
    """What follows the contact, in this order; all empty: nothing does, not even the squeeze.

    Attributes:
        carrying: Phases that carry the object about; the squeeze comes before them.
        pushes: Whether the object is then pushed until it slips.
        shakes: Phases that shake it after that.
    """

    carrying: tuple[Phase, ...] = ()
    pushes: bool = False
    shakes: tuple[Phase, ...] = ()

    @property
    def motions(self) -> tuple[Phase, ...]:
        """Every phase in which the palm moves."""
        return self.carrying + self.shakes


class PhasePlanner(Protocol):
    """Plans what follows the contact, before it is known exactly where that is, and again when it is."""

    def __call__(
        self,
        transform_palm_to_world: FloatArray,
        object_position: FloatArray,
        p: ExecutionParameters,
        tilt_direction: float,
    ) -> PhasePlan:
        """Return the plan.

        Args:
            transform_palm_to_world: The palm at the grasp, shape (4, 4).
            object_position: Centre of the object then, shape (3,), m.
            p: Heights, angles and times.
            tilt_direction: 1 tilts so that a horizontal approach direction turns upwards, -1 downwards.
        """
        ...


def plan_phases(
    transform_palm_to_world: FloatArray,
    object_position: FloatArray,
    p: ExecutionParameters,
    tilt_direction: float,
) -> PhasePlan:
    """Plan the phases up to ``execution.until``; see `PhasePlanner`."""
    if p.until in ("off", "contact"):
        return PhasePlan()
    carrying = plan_lift(transform_palm_to_world, object_position, p, tilt_direction).carrying
    if p.rotation_deg > 0:
        carrying += _tilt(transform_palm_to_world, object_position, p, tilt_direction)
    shakes = _shakes(carrying[-1].motion(1.0), p) if p.until == "shakes" else ()
    return PhasePlan(carrying, p.until in ("pushes", "shakes"), shakes)


def plan_lift(
    transform_palm_to_world: FloatArray,
    object_position: FloatArray,
    p: ExecutionParameters,
    tilt_direction: float,
) -> PhasePlan:
    """Plan a lift and a hold only, whatever ``execution.until`` is; see `PhasePlanner`."""
    low = transform_palm_to_world
    high = _raised(low, p)

    def lifted(share: float) -> FloatArray:
        pose = low.copy()
        pose[2, 3] += smooth(share) * p.lift_height_m
        return pose

    return PhasePlan(
        (Phase("lift", lifted, p.lift_time_s), Phase("hold", lambda _: high, p.hold_time_s)),
    )


def _raised(low: FloatArray, p: ExecutionParameters) -> FloatArray:
    high = low.copy()
    high[2, 3] += p.lift_height_m
    return high


def _tilt(
    low: FloatArray, object_position: FloatArray, p: ExecutionParameters, tilt_direction: float
) -> tuple[Phase, ...]:
    """Return the wrist's tilt about the lifted object, and the hold after it."""
    high = _raised(low, p)
    pivot = object_position.copy()
    pivot[2] += p.lift_height_m
    axis = tilt_direction * np.radians(p.rotation_deg) * tilt_axis(low)

    def tilted(share: float) -> FloatArray:
        turn = np.eye(4)
        turn[:3, :3] = rotation_matrix(smooth(share) * axis)
        turn[:3, 3] = pivot - turn[:3, :3] @ pivot
        pose: FloatArray = turn @ high
        return pose

    turned = tilted(1.0)
    return (
        Phase("rotate", tilted, p.rotation_time_s),
        Phase("hold_rotated", lambda _: turned, p.hold_time_s),
    )


def _shakes(rest: FloatArray, p: ExecutionParameters) -> tuple[Phase, ...]:
    """Return the shakes along the world's axes."""

    def shaken(axis: int) -> PalmMotion:
        def motion(share: float) -> FloatArray:
            # It grows in the first quarter and fades in the last.
            envelope = smooth(4.0 * share) * smooth(4.0 * (1.0 - share))
            phase = 2.0 * np.pi * p.shake_frequency_hz * p.shake_time_s * share
            pose = rest.copy()
            pose[axis, 3] += p.shake_amplitude_m * envelope * np.sin(phase)
            return pose

        return motion

    return tuple(Phase(f"shake_{name}", shaken(axis), p.shake_time_s) for axis, name in enumerate("xyz"))


def palm_task(
    times_s: FloatArray,
    palms: FloatArray,
    object_position: FloatArray,
    p: ExecutionParameters,
    plan: PhasePlanner,
) -> PalmTask:
    """Return what a mount has to do: the planned path, then the phases, for both directions of the tilt.

    Args:
        times_s: Times of the planned path, shape (t,).
        palms: Its transform_palm_to_world, shape (t, 4, 4).
        object_position: The object's centre of mass in the world, shape (3,).
        p: Heights, angles and times of the phases.
        plan: What follows the contact.
    """
    chosen = np.unique(np.linspace(0, len(times_s) - 1, 2 * _KEY_POSES).astype(int))
    passed = {}
    for direction in TILT_DIRECTIONS:
        poses, times = [palms[k] for k in chosen], [float(times_s[k]) for k in chosen]
        for phase in plan(palms[-1], object_position, p, direction).motions:
            start = times[-1]
            count = 4 * _KEY_POSES if phase.name.startswith("shake") else _KEY_POSES
            for share in (np.arange(count) + 1.0) / count:
                poses.append(phase.motion(float(share)))
                times.append(start + float(share) * phase.time_s)
        passed[direction] = np.stack(poses), np.array(times)
    return PalmTask(palms[-1], object_position, tilt_axis(palms[-1]), passed)


def tilt_axis(transform_palm_to_world: FloatArray) -> FloatArray:
    """Return the horizontal direction, shape (3,), about which the wrist is tilted in the rotation phase."""
    approach = transform_palm_to_world[:3, 2]
    axis = np.cross(approach, [0.0, 0.0, 1.0])
    if np.linalg.norm(axis) < 0.1:  # straight down: any horizontal axis of the palm will do
        axis = transform_palm_to_world[:3, 0] * [1.0, 1.0, 0.0]
    unit: FloatArray = axis / np.linalg.norm(axis)
    return unit


def smooth(share: float) -> float:
    """Return a fifth-order step from 0 to 1 that starts and ends at rest."""
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
