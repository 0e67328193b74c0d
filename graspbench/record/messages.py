"""Arrays to Foxglove messages.

Long point lists are packed by numpy straight into protobuf's wire format: a message with a thousand
points takes 20 us this way, against milliseconds when each point is a Python object.
"""

from collections.abc import Iterable
from typing import Any

import cv2
import numpy as np
from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point2_pb2 import Point2
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

from graspbench.arrays import BoolArray, FloatArray, ImageArray, IntArray
from graspbench.perception.camera import Camera

Rgba = tuple[float, float, float, float]


def timestamp(time_ns: int) -> Any:
    """Return a protobuf time stamp."""
    return Timestamp(seconds=time_ns // 1_000_000_000, nanos=time_ns % 1_000_000_000)


def color(rgba: Rgba) -> Any:
    """Return a colour, components from 0 to 1."""
    return Color(r=rgba[0], g=rgba[1], b=rgba[2], a=rgba[3])


def quaternion(rotation: FloatArray) -> Any:
    """Return the unit quaternion of a rotation matrix, shape (3, 3), by its largest component.

    The branch with the largest divisor is taken, so no rotation is ill-conditioned (Shepperd 1978).
    """
    r = rotation
    trace = float(np.trace(r))
    squares = np.array([trace, r[0, 0], r[1, 1], r[2, 2]])
    largest = int(np.argmax(squares))
    if largest == 0:
        q = (r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1.0 + trace)
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        values = [0.0, 0.0, 0.0, r[k, j] - r[j, k]]
        values[i] = 1.0 + 2.0 * r[i, i] - trace
        values[j] = r[j, i] + r[i, j]
        values[k] = r[k, i] + r[i, k]
        q = (values[0], values[1], values[2], values[3])
    unit = np.asarray(q, dtype=np.float64)
    unit = unit / np.linalg.norm(unit)
    return Quaternion(x=unit[0], y=unit[1], z=unit[2], w=unit[3])


def pose(transform: FloatArray) -> Any:
    """Return the pose of a homogeneous matrix, shape (4, 4)."""
    return Pose(position=_vector(transform[:3, 3]), orientation=quaternion(transform[:3, :3]))


def frame_transform(time_ns: int, parent: str, child: str, transform_child_to_parent: FloatArray) -> Any:
    """Return where frame ``child`` is, seen from ``parent``."""
    return FrameTransform(
        timestamp=timestamp(time_ns),
        parent_frame_id=parent,
        child_frame_id=child,
        translation=_vector(transform_child_to_parent[:3, 3]),
        rotation=quaternion(transform_child_to_parent[:3, :3]),
    )


def compressed_image(
    time_ns: int, image: ImageArray | BoolArray, image_format: str, quality: int = 90
) -> Any:
    """Compress an RGB image, shape (h, w, 3), or a mask, shape (h, w), as "jpeg" or "png"."""
    if image.ndim == 2:
        pixels: Any = image.astype(np.uint8) * 255
    else:
        pixels = cv2.cvtColor(np.ascontiguousarray(image).astype(np.uint8), cv2.COLOR_RGB2BGR)
    if image_format == "jpeg":
        options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    else:
        options = [cv2.IMWRITE_PNG_COMPRESSION, 3]
    _, data = cv2.imencode(f".{image_format}", pixels, options)
    return CompressedImage(
        timestamp=timestamp(time_ns), frame_id="camera", data=data.tobytes(), format=image_format
    )


def camera_calibration(time_ns: int, camera: Camera) -> Any:
    """Return a camera's calibration.

    Foxglove counts from the centre of the first pixel, this package from its corner: half a pixel.
    """
    k = camera.intrinsics
    cx, cy = k.cx - 0.5, k.cy - 0.5
    return CameraCalibration(
        timestamp=timestamp(time_ns),
        frame_id="camera",
        width=k.width,
        height=k.height,
        distortion_model="plumb_bob",
        D=list(k.distortion),
        K=[k.fx, 0, cx, 0, k.fy, cy, 0, 0, 1],
        R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
        P=[k.fx, 0, cx, 0, 0, k.fy, cy, 0, 0, 0, 1, 0],
    )


def image_polygons(time_ns: int, polygons: Iterable[tuple[FloatArray, Rgba]]) -> Any:
    """Return closed polygons over an image, each with its colour; points (u, v), shape (n, 2)."""
    return ImageAnnotations(
        points=[
            PointsAnnotation(
                timestamp=timestamp(time_ns),
                type=PointsAnnotation.LINE_LOOP,
                points=[Point2(x=float(u) - 0.5, y=float(v) - 0.5) for u, v in polygon],
                outline_color=color(rgba),
                thickness=2.0,
            )
            for polygon, rgba in polygons
        ]
    )


def point_cloud(time_ns: int, points: FloatArray, normals: FloatArray) -> Any:
    """Return points with normals, both shape (n, 3), in the world."""
    return PointCloud(
        timestamp=timestamp(time_ns),
        frame_id="world",
        pose=pose(np.eye(4)),
        point_stride=24,
        fields=[
            PackedElementField(name=name, offset=4 * i, type=PackedElementField.FLOAT32)
            for i, name in enumerate(("x", "y", "z", "normal_x", "normal_y", "normal_z"))
        ],
        data=np.column_stack((points, normals)).astype("<f4").tobytes(),
    )


def scene(time_ns: int, entity: str, **primitives: Any) -> Any:
    """Return a scene with one entity of world geometry; it replaces the former one of that name."""
    return SceneUpdate(
        entities=[SceneEntity(timestamp=timestamp(time_ns), frame_id="world", id=entity, **primitives)]
    )


def triangles(points: FloatArray, faces: IntArray, rgba: Rgba) -> Any:
    """Return a triangle mesh: points, shape (n, 3), and faces, shape (m, 3)."""
    primitive = TriangleListPrimitive(pose=pose(np.eye(4)), color=color(rgba))
    primitive.MergeFromString(
        _packed_points(TriangleListPrimitive, points) + _packed_indices(TriangleListPrimitive, faces)
    )
    return primitive


def line(points: FloatArray, rgba: Rgba, thickness_m: float) -> Any:
    """Return a polyline through points, shape (n, 3)."""
    primitive = LinePrimitive(
        type=LinePrimitive.LINE_STRIP, pose=pose(np.eye(4)), thickness=thickness_m, color=color(rgba)
    )
    primitive.MergeFromString(_packed_points(LinePrimitive, points))
    return primitive


def sphere(centre: FloatArray, radius_m: float, rgba: Rgba) -> Any:
    """Return a ball."""
    size = 2.0 * radius_m
    return SpherePrimitive(
        pose=Pose(position=_vector(centre), orientation=Quaternion(w=1.0)),
        size=Vector3(x=size, y=size, z=size),
        color=color(rgba),
    )


def arrow(start: FloatArray, direction: FloatArray, length_m: float, rgba: Rgba) -> Any:
    """Return an arrow from ``start`` along the unit vector ``direction``."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    y = np.cross(direction, helper)
    y = y / np.linalg.norm(y)
    transform = np.eye(4)
    transform[:3, :3] = np.column_stack((direction, y, np.cross(direction, y)))
    transform[:3, 3] = start
    return ArrowPrimitive(
        pose=pose(transform),
        shaft_length=0.7 * length_m,
        shaft_diameter=0.08 * length_m,
        head_length=0.3 * length_m,
        head_diameter=0.2 * length_m,
        color=color(rgba),
    )


def _vector(values: FloatArray) -> Any:
    return Vector3(x=float(values[0]), y=float(values[1]), z=float(values[2]))


_POINT = np.dtype(
    [("tag", "u1"), ("size", "u1")]
    + [field for axis in "xyz" for field in ((f"tag_{axis}", "u1"), (axis, "<f8"))]
)


def _packed_points(message: Any, points: FloatArray) -> bytes:
    """Encode the repeated field ``points`` (single precision compresses to half)."""
    number = message.DESCRIPTOR.fields_by_name["points"].number
    records = np.zeros(len(points), dtype=_POINT)
    records["tag"] = number << 3 | 2
    records["size"] = _POINT.itemsize - 2
    for i, axis in enumerate("xyz"):
        records[f"tag_{axis}"] = Point3.DESCRIPTOR.fields_by_name[axis].number << 3 | 1
        records[axis] = points[:, i].astype(np.float32)
    return records.tobytes()


def _packed_indices(message: Any, faces: IntArray) -> bytes:
    """Encode the packed repeated field ``indices``."""
    number = message.DESCRIPTOR.fields_by_name["indices"].number
    data = faces.astype("<u4").tobytes()
    size, length = len(data), bytearray()
    while size >= 128:
        length.append(size & 127 | 128)
        size >>= 7
    length.append(size)
    return bytes([number << 3 | 2]) + bytes(length) + data
