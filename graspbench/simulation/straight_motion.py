"""Motions of a palm as functions of the share of time that has gone by."""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from graspbench.arrays import FloatArray

Goes = Callable[[float], FloatArray]
"""Pose of the palm, shape (4, 4), for the share of a motion's time that has gone by, 0 to 1."""


def between(before: FloatArray, after: FloatArray) -> Goes:
    """Return the motion along a line from one pose to another, turning evenly.

    Args:
        before: Where it begins, shape (4, 4).
        after: Where it ends, shape (4, 4).
    """
    if np.abs(before - after).max() < 1e-12:
        return lambda _: after
    turn = Slerp([0.0, 1.0], Rotation.from_matrix(np.stack((before[:3, :3], after[:3, :3]))))

    def goes(share: float) -> FloatArray:
        pose = np.eye(4)
        pose[:3, :3] = turn(share).as_matrix()
        pose[:3, 3] = (1.0 - share) * before[:3, 3] + share * after[:3, 3]
        return pose

    return goes
