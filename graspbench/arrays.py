"""Array types shared by every module.

Conventions of the whole package, stated once:

* SI units, radians; degrees only in configuration fields whose name ends in ``_deg``.
* Frames are right-handed. The world's z axis points up, the table top is the plane z = 0.
* ``transform_a_to_b`` is the homogeneous matrix, shape (4, 4), that maps coordinates in frame a to
  coordinates in frame b (so it is the pose of frame a seen from frame b).
* A camera's optical frame has x to the right, y down, z along the optical axis.
* Image coordinates are continuous: the pixel of row r and column c covers [c, c + 1] x [r, r + 1].
* Surface normals point OUT of the object. Functions that take contact normals pointing INTO the
  object (the grasp measures) say so in their docstring.
* A twist or wrench stacks the linear part first: [v; omega], [f; tau].
"""

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
ImageArray: TypeAlias = npt.NDArray[np.uint8]


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products of vectors, shapes (..., 3); much faster for few of them than NumPy's own."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack((y * w - z * v, z * u - x * w, x * v - y * u), axis=-1)


def rotation_matrix(rotation_vector: FloatArray) -> FloatArray:
    """Return the matrix of a turn by a rotation vector, shape (3,); much faster for one than SciPy's own."""
    p, q, r = rotation_vector.tolist()
    angle = math.sqrt(p * p + q * q + r * r)
    if angle <= 1e-3:
        square = angle * angle
        scale = 0.5 - square / 48.0 + square * square / 3840.0
    else:
        scale = math.sin(angle / 2.0) / angle
    x, y, z, w = scale * p, scale * q, scale * r, math.cos(angle / 2.0)
    x2, y2, z2, w2 = x * x, y * y, z * z, w * w
    xy, zw, xz, yw, yz, xw = x * y, z * w, x * z, y * w, y * z, x * w
    return np.array(
        [
            [x2 - y2 - z2 + w2, 2.0 * (xy - zw), 2.0 * (xz + yw)],
            [2.0 * (xy + zw), -x2 + y2 - z2 + w2, 2.0 * (yz - xw)],
            [2.0 * (xz - yw), 2.0 * (yz + xw), -x2 - y2 + z2 + w2],
        ]
    )
