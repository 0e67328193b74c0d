"""How meshes and poses are handed to PyBullet."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray


def write_obj(
    path: Path,
    parts: Sequence[tuple[npt.ArrayLike, npt.ArrayLike]],
    normals: npt.ArrayLike | None = None,
) -> None:
    """Write bodies as one OBJ file with one named object each.

    Args:
        path: The file.
        parts: Vertices, shape (n, 3), and triangles, shape (m, 3), of each body.
        normals: One a vertex over all bodies, for smooth shading.
    """
    lines, offset = [], 1
    for number, (vertices, faces) in enumerate(parts):
        lines.append(f"o part{number}")
        points = np.asarray(vertices, dtype=np.float64)
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points.tolist()]
        triangles = np.asarray(faces, dtype=np.int64) + offset
        if normals is None:
            lines += [f"f {a} {b} {c}" for a, b, c in triangles.tolist()]
        else:
            directions = np.asarray(normals, dtype=np.float64)[offset - 1 : offset - 1 + len(points)]
            lines += [f"vn {x:.5f} {y:.5f} {z:.5f}" for x, y, z in directions.tolist()]
            lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in triangles.tolist()]
        offset += len(points)
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def quaternion_of(pose: FloatArray) -> list[float]:
    """Return PyBullet's quaternion (x, y, z, w) of a pose, shape (4, 4)."""
    quaternion: list[float] = Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()
    return quaternion


def pose_of(position: Sequence[float], quaternion: Sequence[float]) -> FloatArray:
    """Return the pose, shape (4, 4), of PyBullet's position and quaternion (x, y, z, w)."""
    # Asked several times a time step: by hand, since SciPy's rotations take longer to make than to use.
    x, y, z, w = quaternion
    s = 2.0 / (x * x + y * y + z * z + w * w)
    return np.array(
        [
            [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w), position[0]],
            [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w), position[1]],
            [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y), position[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
