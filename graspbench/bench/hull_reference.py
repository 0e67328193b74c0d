"""The visual hull as a dense cloud of border points, to measure surfaces against.

The border of the intersection of cones is made of pieces of the cones: each line of sight through a
silhouette's outline lies on it wherever all other silhouettes hold it. That needs no volume grid
and shares nothing with the reconstruction but the projection.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.perception.silhouette import Silhouette
from graspbench.reconstruction.visual_hull import VisualHull


@dataclass(frozen=True, eq=False)
class OrientedCloud:
    """Points that cover a surface densely.

    Attributes:
        points: Shape (n, 3).
        normals: Unit normals, shape (n, 3).
        spacing_m: Largest distance between neighbours.
    """

    points: FloatArray
    normals: FloatArray
    spacing_m: float

    def distances_from(self, queries: FloatArray) -> FloatArray:
        """Return the distance of each query point to the covered surface, shape (n,).

        Close to the cloud it is the distance to the tangent plane of the nearest point.
        """
        distances, nearest = KDTree(self.points).query(queries)
        gaps = np.abs(np.einsum("ij,ij->i", queries - self.points[nearest], self.normals[nearest]))
        exact: FloatArray = np.where(distances < 2 * self.spacing_m, gaps, distances)
        return exact


def hull_border(
    silhouettes: Sequence[Silhouette], *, ground: bool = True, spacing_m: float = 0.3e-3
) -> OrientedCloud:
    """Return border points of the visual hull.

    Args:
        silhouettes: Finely resolved (magnified) ones give the hull of the object itself.
        ground: Whether the hull ends at the plane z = 0.
        spacing_m: Distance between points along and across the lines of sight.
    """
    hull = VisualHull(silhouettes, ground, smoothing_px=1.0)
    inner, radius = _bounding_ball(silhouettes)
    points, normals = [], []
    for silhouette in silhouettes:
        camera = silhouette.camera
        distance = float(np.linalg.norm(camera.position - inner))
        outline, sideways = _outline(silhouette.mask, spacing_m * camera.intrinsics.fx / distance)
        rays = camera.rays(outline)
        along = np.arange(distance - radius, distance + radius, spacing_m)
        strip = (camera.position + rays[:, None] * along[None, :, None]).reshape(-1, 3)
        # Own outline: within half a pixel of the border by construction, so leave a pixel of room.
        room = distance / camera.intrinsics.fx
        kept = hull.signed_distance(strip) < room
        outward = sideways @ camera.rotation_camera_to_world[:, :2].T
        outward -= np.einsum("ij,ij->i", outward, rays)[:, None] * rays
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        points.append(strip[kept])
        normals.append(np.repeat(outward, len(along), axis=0)[kept])
    if ground:
        floor = _floor(inner, radius, spacing_m)
        floor = floor[hull.signed_distance(floor) < 1e-9]
        points.append(floor)
        normals.append(np.tile([0.0, 0.0, -1.0], (len(floor), 1)))
    return OrientedCloud(np.concatenate(points), np.concatenate(normals), spacing_m)


def triangle_samples(points: FloatArray, faces: IntArray, *, spacing_m: float = 0.3e-3) -> OrientedCloud:
    """Cover a triangle mesh with points on a regular grid in each face, corners included."""
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    corners, normals = corners[lengths > 0], normals[lengths > 0] / lengths[lengths > 0, None]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    steps = np.maximum(1, np.ceil(longest / spacing_m)).astype(np.int64)
    clouds, directions = [points], [np.zeros_like(points)]
    directions[0][faces[lengths > 0].ravel()] = np.repeat(normals, 3, axis=0)
    for count in np.unique(steps):
        i, j = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
        low = i + j < count
        # Centres of the upright small triangles suffice: their size is the spacing.
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
    return OrientedCloud(np.concatenate(clouds), np.concatenate(directions), spacing_m)


def _outline(mask: BoolArray, spacing_px: float) -> tuple[FloatArray, FloatArray]:
    """Return points on the mask's border and the image directions that lead out of it there."""
    rows, columns = np.nonzero(mask[:, 1:] != mask[:, :-1])
    upright = np.column_stack((columns + 1.0, rows + 0.5))
    rows, columns = np.nonzero(mask[1:] != mask[:-1])
    level = np.column_stack((columns + 0.5, rows + 1.0))
    cracks = np.vstack((upright, level))
    smooth = _smoothed(mask)
    u, v = cracks[:, 0].astype(np.int64), cracks[:, 1].astype(np.int64)
    slope = np.column_stack((smooth[v, u - 2] - smooth[v, u + 1], smooth[v - 2, u] - smooth[v + 1, u]))
    cells = np.floor(cracks / spacing_px).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    return cracks[first], slope[first]


def _smoothed(mask: BoolArray) -> FloatArray:
    import cv2

    smooth: FloatArray = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), 3.0).astype(np.float64)
    return smooth


def _bounding_ball(silhouettes: Sequence[Silhouette]) -> tuple[FloatArray, float]:
    """Return a ball that holds the object, from the silhouettes' boxes."""
    from graspbench.perception.triangulation import triangulate_centre

    centre = triangulate_centre(silhouettes)
    radius = 0.0
    for silhouette in silhouettes:
        u_min, v_min, u_max, v_max = silhouette.box
        diagonal = np.hypot(u_max - u_min, v_max - v_min)
        distance = float(np.linalg.norm(silhouette.camera.position - centre))
        radius = max(radius, float(diagonal) * distance / silhouette.camera.intrinsics.fx)
    return centre, radius


def _floor(inner: FloatArray, radius: float, spacing_m: float) -> FloatArray:
    side = np.arange(-radius, radius, spacing_m)
    x, y = np.meshgrid(side + inner[0], side + inner[1])
    return np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size)))
