"""Voxel carving, the usual way from silhouettes to a shape: plain, and Open3D's."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.perception.camera import Camera
from graspbench.perception.silhouette import Silhouette

_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_EDGES = np.array(
    [[a, b] for a in range(8) for b in range(a + 1, 8) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1]
)


@dataclass(frozen=True, eq=False)
class VoxelBox:
    """A cube of cubes.

    Attributes:
        low: Its lower corner in the world, shape (3,).
        side_m: Side of a voxel.
        count: Voxels along each axis.
    """

    low: FloatArray
    side_m: float
    count: int


def tight_box(low: FloatArray, high: FloatArray, count: int) -> VoxelBox:
    """Return the smallest cube around a box on the table, two voxels wider at each free side."""
    side = float((high - low).max()) / (count - 4)
    corner = 0.5 * (low + high) - 0.5 * count * side
    corner[2] = 0.0
    return VoxelBox(corner, side, count)


def carve_masks(silhouettes: Sequence[Silhouette], box: VoxelBox) -> BoolArray:
    """Keep each voxel whose centre every silhouette holds, shape (count, count, count)."""
    projections = np.array([_projection(s.camera) for s in silhouettes])
    masks = np.array([s.mask for s in silhouettes])
    occupied = np.empty((box.count,) * 3, dtype=np.bool_)
    _carve(projections, masks, box.low, box.side_m, occupied)
    return occupied


def open3d_carving(
    silhouettes: Sequence[Silhouette], box: VoxelBox
) -> tuple[Callable[[], Any], Callable[[Any], BoolArray]] | None:
    """Return Open3D's carving of the same voxels and what reads its result; None if it is not installed.

    The images and the cameras are converted beforehand.
    """
    try:
        import open3d
    except ImportError:
        return None
    cameras = []
    for silhouette in silhouettes:
        k = silhouette.camera.intrinsics
        camera = open3d.camera.PinholeCameraParameters()
        # There, pixel centres are whole numbers.
        camera.intrinsic = open3d.camera.PinholeCameraIntrinsic(
            k.width, k.height, k.fx, k.fy, k.cx - 0.5, k.cy - 0.5
        )
        camera.extrinsic = np.linalg.inv(silhouette.camera.transform_camera_to_world)
        cameras.append(camera)
    masks: list[Any] = [s.mask.astype(np.float32) for s in silhouettes]
    images = [open3d.geometry.Image(mask) for mask in masks]

    def carve() -> Any:
        grid = open3d.geometry.VoxelGrid.create_dense(
            origin=box.low,
            color=np.zeros(3),
            voxel_size=box.side_m,
            width=box.count * box.side_m,
            height=box.count * box.side_m,
            depth=box.count * box.side_m,
        )
        for image, camera in zip(images, cameras, strict=True):
            grid.carve_silhouette(image, camera)
        return grid

    def read(grid: Any) -> BoolArray:
        occupied = np.zeros((box.count,) * 3, dtype=np.bool_)
        indices = np.array([voxel.grid_index for voxel in grid.get_voxels()]).reshape(-1, 3)
        inside = (indices < box.count).all(axis=1)
        occupied[tuple(indices[inside].T)] = True
        return occupied

    return carve, read


def surface_net(occupied: BoolArray, box: VoxelBox) -> tuple[FloatArray, IntArray]:
    """Return the surface between full and empty voxels (Gibson, "Constrained elastic surface nets", 1998).

    Each cube of eight voxel centres that are not all alike gets a vertex in the mean of the middles of its
    mixed edges; no relaxation follows.

    Returns:
        Vertices in the world, shape (n, 3), and outward triangles, shape (m, 3).
    """
    full = np.pad(occupied, 1)
    cubes = np.lib.stride_tricks.sliding_window_view(full, (2, 2, 2))
    corners = cubes.reshape(*cubes.shape[:3], 8)
    mixed = corners.any(axis=-1) & ~corners.all(axis=-1)
    cut = corners[mixed][:, _EDGES[:, 0]] != corners[mixed][:, _EDGES[:, 1]]
    middles = 0.5 * (_CORNERS[_EDGES[:, 0]] + _CORNERS[_EDGES[:, 1]])
    offsets = cut @ middles / cut.sum(axis=1)[:, None]
    # Corner (0, 0, 0) of the first cube is the centre of the first voxel of the padding.
    vertices = box.low + box.side_m * (np.argwhere(mixed) + offsets - 0.5)
    vertex_of = np.full(mixed.shape, -1)
    vertex_of[mixed] = np.arange(len(vertices))
    faces = [_quads(full, vertex_of, axis) for axis in range(3)]
    return vertices, np.concatenate(faces)


def _quads(full: BoolArray, vertex_of: IntArray, axis: int) -> IntArray:
    """Return two triangles between the four cubes around each edge along an axis that leaves the solid."""
    forward = np.moveaxis(full, (axis, (axis + 1) % 3, (axis + 2) % 3), (0, 1, 2))
    cube = np.moveaxis(vertex_of, (axis, (axis + 1) % 3, (axis + 2) % 3), (0, 1, 2))
    leaving = forward[:-1] != forward[1:]
    i, j, k = np.nonzero(leaving)
    ring = np.stack((cube[i, j - 1, k - 1], cube[i, j, k - 1], cube[i, j, k], cube[i, j - 1, k]), axis=1)
    backward = ~forward[i, j, k]
    ring[backward] = ring[backward, ::-1]
    return np.concatenate((ring[:, [0, 1, 2]], ring[:, [0, 2, 3]]))


def _projection(camera: Camera) -> FloatArray:
    """Return the matrix from world points to homogeneous image points, shape (3, 4)."""
    k = camera.intrinsics
    calibration = np.array([[k.fx, 0.0, k.cx], [0.0, k.fy, k.cy], [0.0, 0.0, 1.0]])
    matrix: FloatArray = calibration @ np.linalg.inv(camera.transform_camera_to_world)[:3]
    return matrix


@compiled
def _carve(
    projections: FloatArray, masks: BoolArray, low: FloatArray, side: float, occupied: BoolArray
) -> None:
    height, width = masks.shape[1], masks.shape[2]
    for i in range(occupied.shape[0]):
        x = low[0] + (i + 0.5) * side
        for j in range(occupied.shape[1]):
            y = low[1] + (j + 0.5) * side
            for k in range(occupied.shape[2]):
                z = low[2] + (k + 0.5) * side
                inside = True
                for view in range(len(masks)):
                    p = projections[view]
                    depth = p[2, 0] * x + p[2, 1] * y + p[2, 2] * z + p[2, 3]
                    u = (p[0, 0] * x + p[0, 1] * y + p[0, 2] * z + p[0, 3]) / depth
                    v = (p[1, 0] * x + p[1, 1] * y + p[1, 2] * z + p[1, 3]) / depth
                    seen = depth > 0.0 and 0.0 <= u < width and 0.0 <= v < height
                    if not seen or not masks[view, int(v), int(u)]:
                        inside = False
                        break
                occupied[i, j, k] = inside
