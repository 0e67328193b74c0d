"""Trajectories of the object: paths with a fifth-order time law (thesis 4.5)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.compiled import compiled
from graspbench.errors import ConfigurationError
from graspbench.manipulation.compiled.record import Record
from graspbench.manipulation.compiled.record_type import opener
from graspbench.manipulation.compiled.rotations import turn
from graspbench.manipulation.compiled.shared import shared
from graspbench.manipulation.gaiting.gait_parameters import GaitParameters
from graspbench.manipulation.pose_sample import PoseSample


class Path(NamedTuple):
    """A path by a parameter s from 0 to 1: origin + s along + cos(phase) cosine + sin(phase) sine.

    Attributes:
        origin: Shape (3,), m.
        along: Shape (3,), m.
        cosine: Shape (3,), m.
        sine: Shape (3,), m.
        start_rad: The phase at s = 0.
        angle_rad: How far it runs; the phase is start_rad + s angle_rad.
    """

    origin: FloatArray
    along: FloatArray
    cosine: FloatArray
    sine: FloatArray
    start_rad: float
    angle_rad: float


@dataclass(frozen=True, eq=False)
class Segment:
    """One piece of a motion: a pause at its start, then a path from rest to rest.

    Attributes:
        duration_s: Of the motion.
        pause_s: Before it.
        path: Of the object's origin.
        rotation_vector: Whole turn of the segment, base frame, shape (3,), rad.
    """

    duration_s: float
    pause_s: float
    path: Path
    rotation_vector: FloatArray


class SegmentArrays(Record):
    """A trajectory's segments, one after another; fields as in `Segment` and `Path`.

    Attributes:
        starts_s: When each begins, its pause included.
        start_rotations: Orientation there.
    """

    starts_s: Annotated[FloatArray, "segments"]
    pauses_s: Annotated[FloatArray, "segments"]
    durations_s: Annotated[FloatArray, "segments"]
    origins: Annotated[FloatArray, "segments", 3]
    alongs: Annotated[FloatArray, "segments", 3]
    cosines: Annotated[FloatArray, "segments", 3]
    sines: Annotated[FloatArray, "segments", 3]
    starts_rad: Annotated[FloatArray, "segments"]
    angles_rad: Annotated[FloatArray, "segments"]
    rotation_vectors: Annotated[FloatArray, "segments", 3]
    start_rotations: Annotated[FloatArray, "segments", 3, 3]


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
        rotations = [np.array(rotation, dtype=np.float64, order="C")]
        for segment in segments:
            vector = np.asarray(segment.rotation_vector, dtype=np.float64)
            rotations.append(turn(vector, 1.0, rotations[-1]))
        ends_s = np.cumsum([0.0, *(segment.pause_s + segment.duration_s for segment in segments)])
        self.duration_s = float(ends_s[-1])
        self._arrays = SegmentArrays(
            starts_s=ends_s[:-1],
            pauses_s=[segment.pause_s for segment in segments],
            durations_s=[segment.duration_s for segment in segments],
            origins=[segment.path.origin for segment in segments],
            alongs=[segment.path.along for segment in segments],
            cosines=[segment.path.cosine for segment in segments],
            sines=[segment.path.sine for segment in segments],
            starts_rad=[segment.path.start_rad for segment in segments],
            angles_rad=[segment.path.angle_rad for segment in segments],
            rotation_vectors=[segment.rotation_vector for segment in segments],
            start_rotations=rotations[:-1],
        )

    def __call__(self, time_s: float) -> PoseSample:
        """Return the pose and twist at a time; before 0 and after the end the object rests."""
        position, rotation = np.empty(3), np.empty((3, 3))
        twist, acceleration = np.empty(6), np.empty(6)
        _sample(self._arrays.block, time_s, position, rotation, twist, acceleration)
        return PoseSample(position, rotation, twist, acceleration)


_open_segments = opener(SegmentArrays)


@compiled
def _sample(
    segments_block: FloatArray,
    time_s: float,
    position: FloatArray,
    rotation: FloatArray,
    twist: FloatArray,
    acceleration: FloatArray,
) -> None:
    """Write the pose, twist and acceleration at a time."""
    segments = _open_segments(segments_block)
    k = len(segments.starts_s) - 1
    while k > 0 and segments.starts_s[k] > time_s:
        k -= 1
    duration, start_rad, angle_rad = segments.durations_s[k], segments.starts_rad[k], segments.angles_rad[k]
    s, rate, second = quintic((time_s - segments.starts_s[k] - segments.pauses_s[k]) / duration)
    rate, second = rate / duration, second / duration**2
    cosine, sine = math.cos(start_rad + s * angle_rad), math.sin(start_rad + s * angle_rad)
    for a in range(3):
        origin, along = segments.origins[k, a], segments.alongs[k, a]
        c, d, turning = segments.cosines[k, a], segments.sines[k, a], segments.rotation_vectors[k, a]
        slope = along + angle_rad * (cosine * d - sine * c)
        bend = -(angle_rad**2) * (cosine * c + sine * d)
        position[a] = origin + s * along + cosine * c + sine * d
        twist[a], twist[3 + a] = slope * rate, turning * rate
        acceleration[a] = bend * rate**2 + slope * second
        acceleration[3 + a] = turning * second
    rotation[:] = turn(segments.rotation_vectors[k], s, segments.start_rotations[k])


@shared
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


def line(start: FloatArray, end: FloatArray) -> Path:
    """Return the straight path between two points."""
    first, nothing = np.array(start, dtype=np.float64), np.zeros(3)
    return Path(first, np.asarray(end, dtype=np.float64) - first, nothing, nothing, 0.0, 0.0)


def arc(centre: FloatArray, radius_m: float, start_rad: float, angle_rad: float) -> Path:
    """Return an arc about ``centre`` in the x-y plane from one polar angle through another."""
    cosine, sine = radius_m * np.array([1.0, 0.0, 0.0]), radius_m * np.array([0.0, 1.0, 0.0])
    return Path(np.array(centre, dtype=np.float64), np.zeros(3), cosine, sine, start_rad, angle_rad)


def reverse(path: Path) -> Path:
    """Return the path run backwards."""
    return Path(
        path.origin + path.along,
        -path.along,
        path.cosine,
        path.sine,
        path.start_rad + path.angle_rad,
        -path.angle_rad,
    )


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
    map_range: Annotated[
        bool, Field(description="First find how far the grasp can move the object along and about each axis")
    ] = False
    gait: Annotated[
        GaitParameters,
        Field(description="Finger gaiting; with an angle it takes the place of all the others"),
    ] = field(default_factory=GaitParameters)


def motion_share(parameters: MotionParameters, time_s: float) -> tuple[float, float]:
    """Return the share of a motion's way that is behind at a time, and its rate, 1/s."""
    there_s = 0.5 * parameters.duration_s if parameters.there_and_back else parameters.duration_s
    share, rate, _ = quintic(time_s / there_s)
    if parameters.there_and_back and time_s > there_s:
        back, rate, _ = quintic(time_s / there_s - 1.0)
        share, rate = 1.0 - back, -rate
    return share, rate / there_s


def object_motion(parameters: MotionParameters, position: FloatArray, rotation: FloatArray) -> Trajectory:
    """Return the trajectory of a motion from the object's present pose in the palm frame."""
    there = line(position, position + np.array(parameters.translation_m))
    turning = np.deg2rad(np.array(parameters.rotation_deg))
    if not parameters.there_and_back:
        return Trajectory([Segment(parameters.duration_s, 0.0, there, turning)], rotation)
    half = 0.5 * parameters.duration_s
    return Trajectory(
        [Segment(half, 0.0, there, turning), Segment(half, 0.0, reverse(there), -turning)], rotation
    )
