"""Axes of files and the z axis up."""

from typing import Literal, TypeAlias

import numpy as np

from graspbench.arrays import FloatArray

Axis: TypeAlias = Literal["x", "y", "z", "-x", "-y", "-z"]


def rotation_to_z(axis: Axis) -> FloatArray:
    """Return the rotation by a multiple of 90 deg that maps a coordinate axis to +z, shape (3, 3).

    It turns about one coordinate axis: a model with y up and z towards the viewer keeps x to the right.
    """
    rows = {
        "z": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "y": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        "-y": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        "-z": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
        "x": [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        "-x": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
    }
    return np.array(rows[axis], dtype=np.float64)
