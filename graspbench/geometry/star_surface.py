"""Surfaces given by a distance in every direction, on a grid without poles."""

from __future__ import annotations

import numpy as np

from graspbench.arrays import FloatArray, IntArray


def cube_sphere(cells: int) -> tuple[FloatArray, IntArray]:
    """Return a grid on the cube [-1, 1]^3 whose rays from the centre are spread evenly.

    Args:
        cells: Cells along an edge of the cube.

    Returns:
        Points, shape (6 cells^2 + 2, 3), and triangles with outward normals, shape (12 cells^2, 3).
    """
    ticks = np.arange(cells + 1)
    row, column = np.meshgrid(ticks, ticks, indexing="ij")
    u, v = row.ravel(), column.ravel()
    corner = (ticks[:-1, None] * (cells + 1) + ticks[None, :-1]).ravel()
    quads = np.stack([corner, corner + cells + 1, corner + cells + 2, corner + 1], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    lattice: list[IntArray] = []
    faces: list[IntArray] = []
    for axis in range(3):
        for side, order in ((cells, 1), (0, -1)):
            points = np.empty((len(u), 3), dtype=np.int64)
            points[:, axis], points[:, (axis + 1) % 3], points[:, (axis + 2) % 3] = side, u, v
            faces.append(triangles[:, ::order] + (cells + 1) ** 2 * len(lattice))
            lattice.append(points)
    unique, label = np.unique(np.concatenate(lattice), axis=0, return_inverse=True)
    steps = np.tan(np.linspace(-np.pi / 4.0, np.pi / 4.0, cells + 1))  # equal angles seen from the centre
    return steps[unique], label.reshape(-1)[np.concatenate(faces)].astype(np.int64)
