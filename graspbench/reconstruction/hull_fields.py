"""The silhouettes' signed distance fields, and how compiled loops read them.

Each silhouette becomes a signed distance field on its cropped bounding box, read bilinearly, so
that the hull's border is known to a fraction of a pixel.
"""

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import cv2
import numpy as np
import numpy.typing as npt

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.errors import ImageError
from graspbench.perception.camera import Camera

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette

FloatImage: TypeAlias = npt.NDArray[np.float32]

PAD = 4
"""Background pixels kept around a silhouette's box."""

BEHIND_CAMERA_M = 1e3

GRADIENT_STEP_M = 0.2e-3

STEEPEST = 1.6
"""Largest change of a view's distance over that of the point: perspective stretches distances."""


class HullFields(NamedTuple):
    """The distance fields as the compiled loops read them.

    Attributes:
        projections: World point to homogeneous position on each field's grid, the 12 numbers of a
            (3, 4) matrix one after the other, shape (12 n_img,).
        metres_per_pixel: Per unit of depth, shape (n_img,).
        starts: Offset of each field in ``values``, shape (n_img,).
        sizes: Rows and columns of each field, shape (2 n_img,).
        values: Signed distances in pixels, negative inside; all fields one after the other.
        ground_m: Height of the ground plane; minus infinity for none.
    """

    projections: FloatArray
    metres_per_pixel: FloatArray
    starts: IntArray
    sizes: IntArray
    values: FloatArray
    ground_m: float


def build_fields(silhouettes: "tuple[Silhouette, ...]", ground: bool, smoothing_px: float) -> HullFields:
    """Return the fields of some silhouettes; arguments as those of `graspbench.reconstruction.VisualHull`."""
    projections, scales, sizes, fields = [], [], [], []
    for silhouette in silhouettes:
        values, row, column = _distance_field(silhouette, smoothing_px)
        camera = silhouette.camera
        # Sample (r, c) of the field is the centre of a pixel, half a pixel from its corner.
        projections.append(_projection(camera, column + 0.5, row + 0.5).ravel())
        scales.append(2.0 / (camera.intrinsics.fx + camera.intrinsics.fy))
        sizes.append(values.shape)
        fields.append(values.ravel())
    lengths = [len(values) for values in fields]
    return HullFields(
        np.concatenate(projections),
        np.array(scales),
        np.cumsum([0, *lengths[:-1]]).astype(np.int64),
        np.array(sizes, dtype=np.int64).ravel(),
        np.concatenate(fields),
        0.0 if ground else -np.inf,
    )


def _distance_field(silhouette: "Silhouette", smoothing_px: float) -> tuple[FloatArray, int, int]:
    """Return the signed distance field of a silhouette and the row and column of its first sample."""
    u_min, v_min, u_max, v_max = silhouette.box
    row, column = int(np.floor(v_min)) - PAD, int(np.floor(u_min)) - PAD
    shape = (int(np.ceil(v_max)) + PAD - row, int(np.ceil(u_max)) + PAD - column)
    coverage = np.zeros(shape, dtype=np.float32)
    top, _, left, _ = silhouette.window
    _paste(silhouette.coverage, top - row, left - column, coverage)
    mask = (coverage >= 0.5).view(np.uint8)
    if not mask.any():
        raise ImageError(
            f"the silhouette of station {silhouette.station} is empty",
            remedy="check the light, the threshold and that the object is in view",
            station=silhouette.station,
        )
    # Distances run between pixel centres; the border lies half a pixel before the first other one.
    values = cv2.distanceTransform(1 - mask, cv2.DIST_L2, cv2.DIST_MASK_5)
    values -= cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_5)
    values += mask
    values -= 0.5
    shared = (coverage > 0.02) & (coverage < 0.98)
    values[shared] = 0.5 - coverage[shared]
    if np.count_nonzero(shared) > 0.5 * (shape[0] + shape[1]):
        # The pixels' shares already tell where the border runs: only their noise is left to filter.
        smoothing_px *= 0.5
    if smoothing_px > 0:
        values = cv2.GaussianBlur(values, (0, 0), smoothing_px, borderType=cv2.BORDER_REPLICATE)
    return values, row, column


def _paste(source: FloatImage, row: int, column: int, target: FloatImage) -> None:
    """Copy an image into another one, at a place where it may stick out."""
    r0, c0 = max(row, 0), max(column, 0)
    r1, c1 = min(row + source.shape[0], target.shape[0]), min(column + source.shape[1], target.shape[1])
    target[r0:r1, c0:c1] = source[r0 - row : r1 - row, c0 - column : c1 - column]


def _projection(camera: Camera, u_origin: float, v_origin: float) -> FloatArray:
    """Return the matrix from world points to homogeneous image points about an origin, shape (3, 4)."""
    k = camera.intrinsics
    calibration = np.array([[k.fx, 0.0, k.cx - u_origin], [0.0, k.fy, k.cy - v_origin], [0.0, 0.0, 1.0]])
    rotation = camera.rotation_camera_to_world.T
    matrix: FloatArray = calibration @ np.column_stack((rotation, -rotation @ camera.position))
    return matrix


@inner
def view_distance(fields: HullFields, view: int, x: float, y: float, z: float) -> float:
    """Return the signed distance (m) of a point to the cone of one silhouette, negative inside.

    View n_img is the ground.
    """
    if view == len(fields.starts):
        return fields.ground_m - z
    p = fields.projections
    k = 12 * view
    depth = p[k + 8] * x + p[k + 9] * y + p[k + 10] * z + p[k + 11]
    if depth <= 0.0:
        return BEHIND_CAMERA_M
    inverse = 1.0 / depth
    u = (p[k] * x + p[k + 1] * y + p[k + 2] * z + p[k + 3]) * inverse
    v = (p[k + 4] * x + p[k + 5] * y + p[k + 6] * z + p[k + 7]) * inverse
    last_column = fields.sizes[2 * view + 1] - 1
    last_row = fields.sizes[2 * view] - 1
    u_near = min(max(u, 0.0), float(last_column))
    v_near = min(max(v, 0.0), float(last_row))
    c = min(int(u_near), last_column - 1)
    r = min(int(v_near), last_row - 1)
    s, t = u_near - c, v_near - r
    first = fields.starts[view] + r * (last_column + 1) + c
    below = first + last_column + 1
    values = fields.values
    pixels = (values[first] * (1.0 - s) + values[first + 1] * s) * (1.0 - t) + (
        values[below] * (1.0 - s) + values[below + 1] * s
    ) * t
    if u_near != u or v_near != v:
        pixels += np.sqrt((u - u_near) ** 2 + (v - v_near) ** 2)
    metres: float = pixels * depth * fields.metres_per_pixel[view]
    return metres


@inner
def hull_distance(fields: HullFields, x: float, y: float, z: float) -> float:
    """Return the signed distance (m) of a point to the visual hull, negative inside."""
    largest = fields.ground_m - z
    for view in range(len(fields.starts)):
        largest = max(largest, view_distance(fields, view, x, y, z))
    return largest


@inner
def critical_view(fields: HullFields, x: float, y: float, z: float) -> tuple[int, float]:
    """Return the view that decides about a point (n_img: the ground) and the hull's signed distance (m)."""
    critical, largest = len(fields.starts), fields.ground_m - z
    for view in range(len(fields.starts)):
        distance = view_distance(fields, view, x, y, z)
        if distance > largest:
            critical, largest = view, distance
    return critical, largest


@inner
def critical_view_near(
    fields: HullFields, x: float, y: float, z: float, seen: FloatArray
) -> tuple[int, float]:
    """As `critical_view`, for points that follow each other closely: most views are not looked at again.

    Args:
        fields: The visual hull's.
        x: First coordinate.
        y: Second coordinate.
        z: Third coordinate.
        seen: Where each view was looked at last and what distance it gave, and the last critical view; as
            `unseen` makes it, shape (n_img + 1, 4).
    """
    count = len(fields.starts)
    critical, largest = count, fields.ground_m - z
    first = int(seen[count, 0])
    for turn in range(count + 1):
        # The view that was critical last comes first.
        view = first if turn == 0 else turn - 1
        if view == count or (turn > 0 and view == first):
            continue
        room = largest - seen[view, 3]
        if room > 0.0:
            way = (x - seen[view, 0]) ** 2 + (y - seen[view, 1]) ** 2 + (z - seen[view, 2]) ** 2
            if room * room > STEEPEST * STEEPEST * way:
                continue
        distance = view_distance(fields, view, x, y, z)
        seen[view, 0], seen[view, 1], seen[view, 2], seen[view, 3] = x, y, z, distance
        if distance > largest:
            critical, largest = view, distance
    seen[count, 0] = critical
    return critical, largest


@inner
def unseen(fields: HullFields) -> FloatArray:
    """Return the memory of `critical_view_near` before its first point, shape (n_img + 1, 4)."""
    seen = np.zeros((len(fields.starts) + 1, 4))
    seen[:, 3] = np.inf
    return seen


@inner
def view_gradient(fields: HullFields, view: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return the unit gradient of the signed distance to one silhouette's cone."""
    gx = gy = gz = 0.0
    for way in range(2):
        h = GRADIENT_STEP_M * (2 * way - 1)
        for k in range(3):
            # In a loop, because each call written out is compiled again.
            distance = view_distance(fields, view, x + h * (k == 0), y + h * (k == 1), z + h * (k == 2))
            gx += h * distance * (k == 0)
            gy += h * distance * (k == 1)
            gz += h * distance * (k == 2)
    length = np.sqrt(gx * gx + gy * gy + gz * gz)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return gx / length, gy / length, gz / length


@inner
def view_slope(
    fields: HullFields, view: int, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Return the signed distance (m) to one silhouette's cone and its unit gradient, by the chain rule.

    One look instead of the six of `view_gradient`; the slope is that of the pixel that the point falls in.
    """
    if view == len(fields.starts):
        return fields.ground_m - z, 0.0, 0.0, -1.0
    p = fields.projections
    k = 12 * view
    depth = p[k + 8] * x + p[k + 9] * y + p[k + 10] * z + p[k + 11]
    if depth <= 0.0:
        return BEHIND_CAMERA_M, 0.0, 0.0, 0.0
    inverse = 1.0 / depth
    u = (p[k] * x + p[k + 1] * y + p[k + 2] * z + p[k + 3]) * inverse
    v = (p[k + 4] * x + p[k + 5] * y + p[k + 6] * z + p[k + 7]) * inverse
    last_column = fields.sizes[2 * view + 1] - 1
    last_row = fields.sizes[2 * view] - 1
    u_near = min(max(u, 0.0), float(last_column))
    v_near = min(max(v, 0.0), float(last_row))
    c = min(int(u_near), last_column - 1)
    r = min(int(v_near), last_row - 1)
    s, t = u_near - c, v_near - r
    first = fields.starts[view] + r * (last_column + 1) + c
    below = first + last_column + 1
    f00, f01 = fields.values[first], fields.values[first + 1]
    f10, f11 = fields.values[below], fields.values[below + 1]
    pixels = (f00 * (1.0 - s) + f01 * s) * (1.0 - t) + (f10 * (1.0 - s) + f11 * s) * t
    along_u = (f01 - f00) * (1.0 - t) + (f11 - f10) * t
    along_v = (f10 - f00) * (1.0 - s) + (f11 - f01) * s
    if u_near != u or v_near != v:
        gap = np.sqrt((u - u_near) ** 2 + (v - v_near) ** 2)
        pixels += gap
        along_u = (along_u if u_near == u else 0.0) + (u - u_near) / gap
        along_v = (along_v if v_near == v else 0.0) + (v - v_near) / gap
    # d(pixels * depth): the perspective's own change of scale counts as well.
    shrink = pixels - along_u * u - along_v * v
    gx = along_u * p[k] + along_v * p[k + 4] + shrink * p[k + 8]
    gy = along_u * p[k + 1] + along_v * p[k + 5] + shrink * p[k + 9]
    gz = along_u * p[k + 2] + along_v * p[k + 6] + shrink * p[k + 10]
    length = np.sqrt(gx * gx + gy * gy + gz * gz)
    scale = 1.0 / length if length > 0.0 else 0.0
    return pixels * depth * fields.metres_per_pixel[view], gx * scale, gy * scale, gz * scale
