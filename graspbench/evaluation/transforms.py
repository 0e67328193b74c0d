"""Rigid transforms as grasp files write them: a position and a quaternion, or angles."""

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray

UNIT_TOLERANCE = 1e-3
"""Norm of a quaternion that is still taken for a rounded unit one: further off, it is none."""


def transform_of(position: FloatArray, quaternion_wxyz: FloatArray) -> FloatArray:
    """Return a homogeneous matrix, shape (4, 4), of a position and a quaternion with w first."""
    transform = np.eye(4)
    transform[:3, :3] = Rotation.from_quat(quaternion_wxyz, scalar_first=True).as_matrix()
    transform[:3, 3] = position
    return transform


def position_and_quaternion(transform: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position, shape (3,), and quaternion with w first and not negative, shape (4,)."""
    turn = Rotation.from_matrix(transform[:3, :3])
    quaternion = np.asarray(turn.as_quat(canonical=True, scalar_first=True), dtype=np.float64)
    return transform[:3, 3].copy(), quaternion


def inverse(transform: FloatArray) -> FloatArray:
    """Return the inverse of a rigid transform, shape (4, 4)."""
    back = np.eye(4)
    back[:3, :3] = transform[:3, :3].T
    back[:3, 3] = -back[:3, :3] @ transform[:3, 3]
    return back
