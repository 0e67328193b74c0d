"""How the palm moves while it carries the object: lift, hold, tilt, shakes."""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.simulation.execution import ExecutionParameters

PalmMotion = Callable[[float], FloatArray]
"""Pose of the palm, shape (4, 4), for the share of a phase's time that has gone by, 0 to 1."""


def carrying(
    low: FloatArray, object_position: FloatArray, p: ExecutionParameters, tilt_direction: float = 1.0
) -> list[tuple[str, PalmMotion, float]]:
    """Return name, motion and duration of the phases that carry the object about.

    Args:
        low: transform_palm_to_world at the grasp, shape (4, 4).
        object_position: Centre of the object then, shape (3,).
        p: Heights, angles and times.
        tilt_direction: 1 tilts so that a horizontal approach direction turns upwards, -1 downwards.
    """
    high = low.copy()
    high[2, 3] += p.lift_height_m
    pivot = object_position.copy()
    pivot[2] += p.lift_height_m
    axis = tilt_direction * np.radians(p.rotation_deg) * tilt_axis(low)

    def lifted(share: float) -> FloatArray:
        pose = low.copy()
        pose[2, 3] += smooth(share) * p.lift_height_m
        return pose

    def tilted(share: float) -> FloatArray:
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(smooth(share) * axis).as_matrix()
        turn[:3, 3] = pivot - turn[:3, :3] @ pivot
        pose: FloatArray = turn @ high
        return pose

    phases = [("lift", lifted, p.lift_time_s), ("hold", lambda _: high, p.hold_time_s)]
    if p.rotation_deg > 0:
        turned = tilted(1.0)
        phases += [
            ("rotate", tilted, p.rotation_time_s),
            ("hold_rotated", lambda _: turned, p.hold_time_s),
        ]
    return phases


def shakes(rest: FloatArray, p: ExecutionParameters) -> list[tuple[str, PalmMotion, float]]:
    """Return name, motion and duration of the shakes along the world's axes."""

    def shaken(axis: int) -> PalmMotion:
        def motion(share: float) -> FloatArray:
            # It grows in the first quarter and fades in the last.
            envelope = smooth(4.0 * share) * smooth(4.0 * (1.0 - share))
            phase = 2.0 * np.pi * p.shake_frequency_hz * p.shake_time_s * share
            pose = rest.copy()
            pose[axis, 3] += p.shake_amplitude_m * envelope * np.sin(phase)
            return pose

        return motion

    return [(f"shake_{name}", shaken(axis), p.shake_time_s) for axis, name in enumerate("xyz")]


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
