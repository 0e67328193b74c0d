"""How near a reconstruction comes to the visual hull and to the object."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.bench.exact_silhouettes import exact_silhouettes
from graspbench.bench.hull_reference import OrientedCloud, hull_border, triangle_cloud
from graspbench.compiled import compiled
from graspbench.perception.camera import Camera
from graspbench.perception.silhouette import Silhouette, silhouette_of_mask
from graspbench.reconstruction.preshaping import polyhedron_vertices
from graspbench.reconstruction.visual_hull import VisualHull

MAGNIFICATION = 4
"""How much finer than the images the reference's silhouettes are, along each side."""

MARGIN_M = 0.01


@dataclass(frozen=True, eq=False)
class Reference:
    """What reconstructions of one object are measured against.

    Attributes:
        hull: Border of the visual hull that perfect, much finer images would give.
        seen_hull: Border of the visual hull of the images as they are, pixel by pixel.
        surface: The object's own surface.
        solid: Which cells of a grid the object fills, shape (nx, ny, nz).
        hull_solid: Which of them the hull fills.
        low: Lower corner of the grid, shape (3,).
        cell_m: Side of a cell.
    """

    hull: OrientedCloud
    seen_hull: OrientedCloud
    surface: OrientedCloud
    solid: BoolArray
    hull_solid: BoolArray
    low: FloatArray
    cell_m: float


@dataclass(frozen=True)
class Accuracy:
    """Distances (m) between a reconstruction and its reference, and their common volume.

    Attributes:
        hull_mean_m: Mean distance of the reconstruction to the perfect hull.
        hull_hausdorff_m: Hausdorff distance between reconstruction and perfect hull.
        to_seen_hull_m: Largest distance of the reconstruction to the hull of the images as they are.
        from_seen_hull_m: Largest distance of that hull to the reconstruction.
        object_mean_m: Mean distance of the reconstruction to the object.
        object_hausdorff_m: Hausdorff distance between reconstruction and object.
        iou: Common volume of reconstruction and object over the volume of both together.
    """

    hull_mean_m: float
    hull_hausdorff_m: float
    to_seen_hull_m: float
    from_seen_hull_m: float
    object_mean_m: float
    object_hausdorff_m: float
    iou: float


def build_reference(
    vertices: FloatArray,
    faces: IntArray,
    cameras: Sequence[Camera],
    silhouettes: Sequence[Silhouette],
    *,
    spacing_m: float,
    ground: bool = True,
) -> Reference:
    """Compute the visual hulls of a mesh, and cover them and the mesh with points.

    A hull's thin wedges can be too narrow for the images' pixels: what no reconstruction from these
    images could find is in the perfect hull only.

    Args:
        vertices: The object's vertices in the world, shape (n, 3).
        faces: Its outward triangles, shape (m, 3).
        cameras: Where the images were really taken.
        silhouettes: What was found in the images; only their masks are used.
        spacing_m: Between points, and between cells of the grid.
        ground: Whether the hull ends at the plane z = 0.

    Raises:
        ImageError: An image does not show the whole object.
    """
    names = [silhouette.station for silhouette in silhouettes]
    hull = VisualHull(exact_silhouettes(vertices, faces, cameras, names, magnification=MAGNIFICATION), ground)
    masks = [silhouette_of_mask(s.station, s.mask, s.camera) for s in silhouettes]
    # The hull sticks out of the object's own box where no camera looks along the box's sides.
    corners = polyhedron_vertices(masks, vertices.mean(axis=0), ground=ground)
    low, high = corners.min(axis=0), corners.max(axis=0)
    border = hull_border(hull, low - MARGIN_M, high + MARGIN_M, spacing_m=spacing_m)
    corner = border.points.min(axis=0) - MARGIN_M
    counts = np.ceil((border.points.max(axis=0) + MARGIN_M - corner) / spacing_m).astype(np.int64)
    axes = [corner[k] + (np.arange(counts[k]) + 0.5) * spacing_m for k in range(3)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Reference(
        border,
        hull_border(VisualHull(masks, ground), low - MARGIN_M, high + MARGIN_M, spacing_m=spacing_m),
        triangle_cloud(vertices, faces, spacing_m=spacing_m),
        filled_cells(vertices, faces, corner, spacing_m, counts),
        hull.contains(cells).reshape(counts),
        corner,
        spacing_m,
    )


def measure(points: FloatArray, faces: IntArray, reference: Reference) -> Accuracy:
    """Measure a closed triangulated surface.

    Args:
        points: Its vertices, shape (n, 3).
        faces: Outward triangles, shape (m, 3).
        reference: The hull and the object.
    """
    cloud = triangle_cloud(points, faces, spacing_m=reference.cell_m)
    solid = filled_cells(points, faces, reference.low, reference.cell_m, np.array(reference.solid.shape))
    return _compare(cloud, solid, reference)


def measure_hull(reference: Reference) -> Accuracy:
    """Measure the visual hull itself: no reconstruction from these images can be surely nearer."""
    return _compare(reference.hull, reference.hull_solid, reference)


def _compare(cloud: OrientedCloud, solid: BoolArray, reference: Reference) -> Accuracy:
    to_hull = reference.hull.distances_from(cloud.points)
    from_hull = cloud.distances_from(reference.hull.points)
    to_object = reference.surface.distances_from(cloud.points)
    from_object = cloud.distances_from(reference.surface.points)
    return Accuracy(
        float(np.average(to_hull, weights=cloud.areas)),
        float(max(to_hull.max(), from_hull.max())),
        float(reference.seen_hull.distances_from(cloud.points).max()),
        float(cloud.distances_from(reference.seen_hull.points).max()),
        float(np.average(to_object, weights=cloud.areas)),
        float(max(to_object.max(), from_object.max())),
        float(np.count_nonzero(solid & reference.solid) / np.count_nonzero(solid | reference.solid)),
    )


def filled_cells(
    points: FloatArray, faces: IntArray, low: FloatArray, cell_m: float, counts: IntArray
) -> BoolArray:
    """Return which cells of a grid have their centre inside a closed surface, shape ``counts``.

    Inside is where the surface winds around a point at least once.

    Args:
        points: Vertices, shape (n, 3).
        faces: Outward triangles, shape (m, 3).
        low: Lower corner of the grid, shape (3,).
        cell_m: Side of a cell.
        counts: Cells along each axis, shape (3,).
    """
    steps = np.zeros((counts[0], counts[1], counts[2] + 1), dtype=np.int16)
    _enter_and_leave(np.ascontiguousarray(((points - low) / cell_m - 0.5)[faces]), steps)
    inside: BoolArray = np.cumsum(steps[:, :, :-1], axis=2, dtype=np.int16) > 0
    return inside


@compiled
def _enter_and_leave(corners: FloatArray, steps: IntArray) -> None:
    """Count, for each vertical line through cell centres, where it enters (+1) and leaves (-1) the solid."""
    for f in range(len(corners)):
        # A line through an edge must meet one of its two triangles: an odd shift leaves no such line.
        ax, ay, az = corners[f, 0, 0] + 1.7e-7, corners[f, 0, 1] + 3.1e-7, corners[f, 0, 2]
        bx, by, bz = corners[f, 1, 0] + 1.7e-7, corners[f, 1, 1] + 3.1e-7, corners[f, 1, 2]
        cx, cy, cz = corners[f, 2, 0] + 1.7e-7, corners[f, 2, 1] + 3.1e-7, corners[f, 2, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        step = 1 if area < 0.0 else -1
        first_i, first_j = max(0, int(np.ceil(min(ax, bx, cx)))), max(0, int(np.ceil(min(ay, by, cy))))
        for i in range(first_i, min(steps.shape[0] - 1, int(max(ax, bx, cx))) + 1):
            for j in range(first_j, min(steps.shape[1] - 1, int(max(ay, by, cy))) + 1):
                wb = ((cy - ay) * (i - ax) - (cx - ax) * (j - ay)) / area
                wc = ((bx - ax) * (j - ay) - (by - ay) * (i - ax)) / area
                if wb >= 0.0 and wc >= 0.0 and wb + wc <= 1.0:
                    z = az + wb * (bz - az) + wc * (cz - az)
                    k = min(max(int(np.ceil(z)), 0), steps.shape[2] - 1)
                    steps[i, j, k] += step
