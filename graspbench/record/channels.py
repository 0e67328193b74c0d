"""What a trial's log holds: its channels, and how much of them is kept at which level."""

from dataclasses import dataclass
from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from graspbench.record.parameters import Level


@dataclass(frozen=True)
class Channel:
    """One channel of the log.

    Attributes:
        topic: Its name.
        message: Its protobuf message; None for JSON.
        level: The lowest level of recording that keeps it.
        description: What it carries; stored in the file.
    """

    topic: str
    message: Any
    level: Level
    description: str


CHANNELS = {
    channel.topic: channel
    for channel in (
        Channel("/log", Log, "scores", "what happens, in sentences"),
        Channel("/scores", None, "scores", "scalar results by dotted name"),
        Channel("/tf", FrameTransforms, "full", "poses of camera, object and palm in the world"),
        Channel("/camera/image", CompressedImage, "full", "the view of each station"),
        Channel("/camera/calibration", CameraCalibration, "full", "the calibration of each view"),
        Channel(
            "/camera/annotations", ImageAnnotations, "full", "outline and bounding box of the silhouette"
        ),
        Channel("/camera/silhouette", CompressedImage, "full", "the silhouette, white on black"),
        Channel("/object/pose", PoseInFrame, "full", "true pose of the object (simulation only)"),
        Channel("/surface/mesh", SceneUpdate, "full", "snapshots of the reconstruction surface"),
        Channel("/surface/points", PointCloud, "full", "nodes of the surface at rest, with their normals"),
        Channel("/grasp", SceneUpdate, "full", "contacts, their normals, the centroid; felt points"),
        Channel("/paths", SceneUpdate, "full", "fingertip paths: floating, approach, grasp"),
        Channel("/hand", SceneUpdate, "full", "the hand's links"),
        Channel("/joints", JointStates, "full", "joint positions"),
    )
}

_ORDER = ("off", "scores", "full")


def keeps(level: Level, topic: str) -> bool:
    """Tell whether a log of ``level`` keeps the channel ``topic``."""
    return level != "off" and _ORDER.index(level) >= _ORDER.index(CHANNELS[topic].level)
