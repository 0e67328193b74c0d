"""Where the object shall be at one time."""

from typing import NamedTuple

from graspbench.arrays import FloatArray


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
