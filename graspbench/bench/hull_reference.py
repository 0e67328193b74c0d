"""Surfaces as dense clouds of points, to measure reconstructions against."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import KDTree

from graspbench.arrays import FloatArray, IntArray
from graspbench.reconstruction.border import sample_border
from graspbench.reconstruction.visual_hull import VisualHull


@dataclass(frozen=True, eq=False)
class OrientedCloud:
    """Points that cover a surface densely.

    Attributes:
        points: Shape (n, 3).
        normals: Unit normals, shape (n, 3).
        spacing_m: Largest distance between neighbours.
        areas: Share of the surface that each point stands for (any unit), shape (n,); None: all alike.
        tree: The points, for searches.
    """

    points: FloatArray
    normals: FloatArray
    spacing_m: float
    areas: FloatArray | None = None
    tree: KDTree = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tree", KDTree(self.points))

    def distances_from(self, queries: FloatArray) -> FloatArray:
        """Return the distance of each query point to the covered surface, shape (n,).

        Close to the cloud it is the distance to the tangent plane of the nearest point.
        """
        distances, nearest = self.tree.query(queries)
        gaps = np.abs(np.einsum("ij,ij->i", queries - self.points[nearest], self.normals[nearest]))
        exact: FloatArray = np.where(distances < 2 * self.spacing_m, gaps, distances)
        return exact


def hull_border(
    hull: VisualHull, low: FloatArray, high: FloatArray, *, spacing_m: float = 0.6e-3
) -> OrientedCloud:
    """Cover the border of a visual hull's largest connected part.

    Args:
        hull: Of finely resolved silhouettes to get the hull of the object itself.
        low: Lower corner of a box that holds the object, shape (3,).
        high: Upper corner, shape (3,).
        spacing_m: Of the grid.

    Raises:
        ReconstructionError: No grid point lies in the hull.
    """
    points = sample_border(hull, low, high, spacing_m)
    return OrientedCloud(points, hull.gradient(points), 1.5 * spacing_m)


def triangle_cloud(points: FloatArray, faces: IntArray, *, spacing_m: float = 0.4e-3) -> OrientedCloud:
    """Cover a triangle mesh with points on a regular grid in each face."""
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    corners, normals = corners[lengths > 0], normals[lengths > 0] / lengths[lengths > 0, None]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    steps = np.maximum(1, np.ceil(longest / spacing_m)).astype(np.int64)
    clouds, directions, areas = [], [], []
    face_areas = 0.5 * lengths[lengths > 0]
    for count in np.unique(steps):
        i, j = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
        low = i + j < count
        # Centres of the upright small triangles: their size is the spacing.
        u, v = (i[low] + 1 / 3) / count, (j[low] + 1 / 3) / count
        chosen = corners[steps == count]
        clouds.append(
            (
                chosen[:, None, 0] * (1 - u - v)[None, :, None]
                + chosen[:, None, 1] * u[None, :, None]
                + chosen[:, None, 2] * v[None, :, None]
            ).reshape(-1, 3)
        )
        directions.append(np.repeat(normals[steps == count], len(u), axis=0))
        areas.append(np.repeat(face_areas[steps == count] / len(u), len(u)))
    return OrientedCloud(np.concatenate(clouds), np.concatenate(directions), spacing_m, np.concatenate(areas))
