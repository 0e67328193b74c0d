"""Trajectories of the object: paths with a fifth-order time law (thesis 4.5)."""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.manipulation.rotations import turn


class PoseSample(NamedTuple):
    """Where the object shall be.

    Attributes:
        position: Shape (3,), m, base frame.
        rotation: Shape (3, 3).
        twist: [v; omega] of the object's origin, shape (6,), base frame.
        acceleration: Linear and angular acceleration, shape (6,).
    """

    position: FloatArray
    rotation: FloatArray
    twist: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class Segment:
    """One piece of a path: a pause at its start, then a motion from rest to rest.

    Attributes:
        duration_s: Of the motion.
        pause_s: Before it.
        position: Position, and its first and second derivative, by the path parameter 0 to 1.
        rotation_vector: Whole turn of the segment, base frame, shape (3,), rad.
    """

    duration_s: float
    pause_s: float
    position: Callable[[float], tuple[FloatArray, FloatArray, FloatArray]]
    rotation_vector: FloatArray


class Trajectory:
    """Segments one after another, starting from a given orientation.

    Args:
        segments: The pieces; each begins where the one before it ends.
        rotation: Orientation at the start, shape (3, 3).
    """

    def __init__(self, segments: Sequence[Segment], rotation: FloatArray) -> None:
        if not segments:
            raise ConfigurationError("a trajectory needs a segment")
        self.segments = tuple(segments)
        ends = np.cumsum([segment.pause_s + segment.duration_s for segment in segments])
        self._starts = [0.0, *(float(end) for end in ends[:-1])]
        self.duration_s = float(ends[-1])
        self._rotations = [np.array(rotation, dtype=np.float64, order="C")]
        self._turning = [bool(np.any(segment.rotation_vector)) for segment in segments]
        for segment in segments:
            self._rotations.append(turn(segment.rotation_vector, 1.0, self._rotations[-1]))

    def __call__(self, time_s: float) -> PoseSample:
        """Return the pose and twist at a time; before 0 and after the end the object rests."""
        k = max(bisect_right(self._starts, time_s) - 1, 0)
        segment = self.segments[k]
        t = (time_s - self._starts[k] - segment.pause_s) / segment.duration_s
        s, rate, second = quintic(t)
        rate, second = rate / segment.duration_s, second / segment.duration_s**2
        position, along, bend = segment.position(s)
        twist, acceleration = np.empty(6), np.empty(6)
        if rate == 0.0 and second == 0.0:
            twist[:], acceleration[:] = 0.0, 0.0
        else:
            twist[:3], twist[3:] = along * rate, segment.rotation_vector * rate
            acceleration[:3] = bend * rate**2 + along * second
            acceleration[3:] = segment.rotation_vector * second
        if s <= 0.0 or not self._turning[k]:
            rotation = self._rotations[k]
        elif s >= 1.0:
            rotation = self._rotations[k + 1]
        else:
            rotation = turn(segment.rotation_vector, s, self._rotations[k])
        return PoseSample(position, rotation, twist, acceleration)


def quintic(t: float) -> tuple[float, float, float]:
    """Return the fifth-order time law from 0 to 1 with rest at both ends, and two derivatives."""
    if t <= 0.0:
        return 0.0, 0.0, 0.0
    if t >= 1.0:
        return 1.0, 0.0, 0.0
    value = t**3 * (10.0 + t * (-15.0 + 6.0 * t))
    rate = 30.0 * t**2 * (1.0 - t) ** 2
    second = 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t)
    return value, rate, second


def line(start: FloatArray, end: FloatArray) -> Callable[[float], tuple[FloatArray, FloatArray, FloatArray]]:
    """Return the straight path between two points."""
    first, along = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64) - start
    nothing = np.zeros(3)
    return lambda s: (first + s * along, along, nothing)


def arc(
    centre: FloatArray, radius_m: float, start_rad: float, angle_rad: float
) -> Callable[[float], tuple[FloatArray, FloatArray, FloatArray]]:
    """Return an arc about ``centre`` in the x-y plane from one polar angle through another."""

    def path(s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        a = start_rad + s * angle_rad
        outward = radius_m * np.array([np.cos(a), np.sin(a), 0.0])
        along = angle_rad * np.array([-outward[1], outward[0], 0.0])
        return centre + outward, along, -(angle_rad**2) * outward

    return path


def reverse(
    path: Callable[[float], tuple[FloatArray, FloatArray, FloatArray]],
) -> Callable[[float], tuple[FloatArray, FloatArray, FloatArray]]:
    """Return the path run backwards."""

    def back(s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        position, along, bend = path(1.0 - s)
        return position, -along, bend

    return back


@dataclass(frozen=True)
class MotionParameters:
    """How the hand shall move the object: configuration group ``motion``.

    Translation and rotation run together, so both along one axis make a screw.
    """

    name: Annotated[str, Field(description="Name of the motion")] = "screw"
    translation_m: Annotated[
        tuple[float, float, float], Field(description="Translation of the object's centre, palm axes, m")
    ] = (0.0, 0.0, 0.01)
    rotation_deg: Annotated[
        tuple[float, float, float], Field(description="Rotation vector of the object, palm axes, deg")
    ] = (0.0, 0.0, 10.0)
    duration_s: Annotated[float, Field(gt=0, description="Duration of the whole motion, s")] = 5.0
    there_and_back: Annotated[bool, Field(description="Return to the start in the second half")] = True


def object_motion(parameters: MotionParameters, position: FloatArray, rotation: FloatArray) -> Trajectory:
    """Return the trajectory of a motion from the object's present pose in the palm frame."""
    there = line(position, position + np.array(parameters.translation_m))
    turn = np.deg2rad(np.array(parameters.rotation_deg))
    if not parameters.there_and_back:
        return Trajectory([Segment(parameters.duration_s, 0.0, there, turn)], rotation)
    half = 0.5 * parameters.duration_s
    return Trajectory([Segment(half, 0.0, there, turn), Segment(half, 0.0, reverse(there), -turn)], rotation)
