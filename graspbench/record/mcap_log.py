"""The log of a trial, one MCAP file that Foxglove and Rerun open."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import cv2
import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from graspbench.arrays import BoolArray, FloatArray
from graspbench.record import messages
from graspbench.record.channels import keeps
from graspbench.record.chunked_file import ChunkedFile
from graspbench.record.parameters import Level, RecordParameters

if TYPE_CHECKING:  # a log only reads attributes: no need to load the stages
    from graspbench.grasp.configuration import Grasp
    from graspbench.perception.camera import View
    from graspbench.perception.silhouette import Silhouette
    from graspbench.planning.trajectory import FingertipPath
    from graspbench.reconstruction.surface import Surface
    from graspbench.simulation.execution_result import Motion

SURFACE: messages.Rgba = (0.55, 0.70, 0.86, 0.85)
CONTACT: messages.Rgba = (0.85, 0.10, 0.15, 1.0)
CENTROID: messages.Rgba = (0.10, 0.10, 0.10, 1.0)
FLOATING: messages.Rgba = (0.98, 0.80, 0.10, 1.0)
APPROACH: messages.Rgba = (0.15, 0.65, 0.30, 1.0)
GRASP: messages.Rgba = (0.85, 0.10, 0.15, 1.0)
FELT: messages.Rgba = (0.20, 0.35, 0.90, 1.0)
HAND: messages.Rgba = (0.35, 0.38, 0.42, 0.9)
OUTLINE: messages.Rgba = (0.10, 0.85, 0.35, 1.0)
BOX: messages.Rgba = (1.0, 0.75, 0.10, 1.0)

_LEVELS = {"debug": Log.DEBUG, "info": Log.INFO, "warning": Log.WARNING, "error": Log.ERROR}


class TrialLog:
    """Writer of a trial's log, used as a context manager.

    Time in the log is the robot's, not the clock's: every view takes `VIEW_S`, every surface snapshot
    `SNAPSHOT_S`, a motion takes as long as it is planned to. So two logs of the same trial are equal.

    Each call ends a chunk of the file and hands it to the operating system: a killed process loses
    what it was about to write, nothing before. The file is called ``*.mcap.partial`` until it is closed; when
    the trial raises it keeps that name, and `recover_log` makes a whole file of it.

    Args:
        path: Where the log goes, ``*.mcap``; its folder exists.
        record: What is kept, or just its level. At level "off" nothing is written.
    """

    VIEW_S = 0.5
    SNAPSHOT_S = 0.05

    def __init__(self, path: Path, record: RecordParameters | Level = "full") -> None:
        self.path = path
        self.parameters = record if isinstance(record, RecordParameters) else RecordParameters(level=record)
        self._time_ns = 0
        self._snapshots = 0
        self._skipped: Surface | None = None
        self._file: ChunkedFile | None = None

    def __enter__(self) -> Self:
        if self.parameters.level != "off":
            self._file = ChunkedFile(self.path)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is None:
            return
        if error is None:
            self._flush_skipped()
            self._file.finish()
        else:
            self.message(str(error), level="error")
            self._file.abandon()
        self._file = None

    @property
    def time_s(self) -> float:
        """Time in the log up to now."""
        return self._time_ns * 1e-9

    def metadata(self, name: str, values: Mapping[str, object]) -> None:
        """Store key-value pairs about the trial (versions, identity)."""
        if self._file is not None:
            self._file.metadata(name, values)

    def attach(self, name: str, text: str, media_type: str = "application/yaml") -> None:
        """Store a whole text, such as the resolved configuration."""
        if self._file is not None:
            self._file.attach(name, text, media_type, self._time_ns)

    def message(self, text: str, *, level: str = "info", stage: str = "trial") -> None:
        """Log a sentence; ``level`` is debug, info, warning or error."""
        stamp = messages.timestamp(self._time_ns)
        self._put("/log", Log(timestamp=stamp, level=_LEVELS[level], message=text, name=stage))
        self._end_chunk()

    def scores(self, values: Mapping[str, Any]) -> None:
        """Log scalar results by dotted name; what is not finite becomes null."""
        clean = {key: _json_scalar(value) for key, value in values.items()}
        self._put("/scores", json.dumps(clean, sort_keys=True).encode())
        self._end_chunk()

    def views(self, views: Sequence[View], silhouettes: Sequence[Silhouette] = ()) -> None:
        """Log the views, one after the other, each with its silhouette if there is one."""
        if not keeps(self.parameters.level, "/camera/image"):
            return
        found = {silhouette.station: silhouette for silhouette in silhouettes}
        for view in views:
            self._view(view, found.get(view.station))
            self._advance(self.VIEW_S)

    def followed_views(
        self,
        views: Sequence[View],
        silhouettes: Sequence[Silhouette],
        true_poses: Sequence[FloatArray],
        estimated_poses: Sequence[FloatArray],
    ) -> None:
        """Log views of a moving object at the times at which they were taken.

        Args:
            views: Each with its time, ascending.
            silhouettes: Their silhouettes.
            true_poses: Where the object truly was, shape (4, 4) each.
            estimated_poses: Where the estimated motion carries the object's centre, shape (4, 4) each.
        """
        found = {silhouette.station: silhouette for silhouette in silhouettes}
        start, first = self._time_ns, views[0].time_s or 0.0
        for view, true_pose, estimated in zip(views, true_poses, estimated_poses, strict=True):
            self._time_ns = start + round(((view.time_s or 0.0) - first) * 1e9)
            self.object_pose(true_pose)
            transform = messages.frame_transform(self._time_ns, "world", "object_estimated", estimated)
            self._put("/tf", FrameTransforms(transforms=[transform]))
            if keeps(self.parameters.level, "/camera/image"):
                self._view(view, found.get(view.station))
        self._advance(self.VIEW_S)

    def _view(self, view: View, silhouette: Silhouette | None) -> None:
        """Log a view now, with its silhouette if there is one."""
        t, camera = self._time_ns, view.camera
        pose = messages.frame_transform(t, "world", "camera", camera.transform_camera_to_world)
        self._put("/tf", FrameTransforms(transforms=[pose]))
        self._put("/camera/calibration", messages.camera_calibration(t, camera))
        image = messages.compressed_image(
            t, view.image, self.parameters.image_format, self.parameters.jpeg_quality
        )
        self._put("/camera/image", image)
        if silhouette is not None:
            self._silhouette(silhouette)
        self.message(f"view from station {view.station}", level="debug", stage="perception")

    def object_pose(self, transform_object_to_world: FloatArray) -> None:
        """Log where the object truly is."""
        t = self._time_ns
        pose = PoseInFrame(
            timestamp=messages.timestamp(t), frame_id="world", pose=messages.pose(transform_object_to_world)
        )
        self._put("/object/pose", pose)
        transform = messages.frame_transform(t, "world", "object", transform_object_to_world)
        self._put("/tf", FrameTransforms(transforms=[transform]))
        self._end_chunk()

    def surface(self, surface: Surface) -> None:
        """Log a snapshot of the surface; some are left out as the parameters say, never the last."""
        if not keeps(self.parameters.level, "/surface/mesh"):
            return
        due = self._snapshots % self.parameters.surface_every == 0
        self._snapshots += 1
        self._skipped = None if due or surface.at_rest else surface
        if self._skipped is None:
            self._surface(surface)
        self._advance(self.SNAPSHOT_S)

    def grasp(self, grasp: Grasp, name: str = "local") -> None:
        """Log a grasp; a later one of the same name replaces it in the viewer."""
        if not keeps(self.parameters.level, "/grasp"):
            return
        size = 0.004
        spheres = [messages.sphere(point, size, CONTACT) for point in grasp.points]
        spheres.append(messages.sphere(grasp.centroid, 1.2 * size, CENTROID))
        arrows = [
            messages.arrow(point - 0.03 * inward, inward, 0.03, CONTACT)
            for point, inward in zip(grasp.points, -grasp.normals, strict=True)
        ]
        self._put("/grasp", messages.scene(self._time_ns, f"grasp/{name}", spheres=spheres, arrows=arrows))
        if grasp.posture is not None:
            palm = grasp.posture.transform_palm_to_world
            transform = messages.frame_transform(self._time_ns, "world", f"palm/{name}", palm)
            self._put("/tf", FrameTransforms(transforms=[transform]))
        self._end_chunk()

    def felt(self, points: FloatArray) -> None:
        """Log points that exploring touches felt, shape (n, 3), world frame."""
        spheres = [messages.sphere(point, 0.004, FELT) for point in points]
        self._put("/grasp", messages.scene(self._time_ns, "felt", spheres=spheres))
        self._end_chunk()

    def paths(self, paths: Iterable[FingertipPath]) -> None:
        """Log the fingertip paths: floating points yellow, approach green, grasp red."""
        if not keeps(self.parameters.level, "/paths"):
            return
        spheres, lines = [], []
        for path in paths:
            spheres += [messages.sphere(point, 0.002, FLOATING) for point in path.via]
            lines += [
                messages.line(path.approach, APPROACH, 0.002),
                messages.line(path.grasp, GRASP, 0.002),
            ]
        self._put("/paths", messages.scene(self._time_ns, "paths", spheres=spheres, lines=lines))
        self._end_chunk()

    def joints(
        self,
        names: Sequence[str],
        times_s: FloatArray,
        joints: FloatArray,
        transform_palm_to_world: FloatArray | None = None,
        skeletons: FloatArray | None = None,
        transform_object_to_world: FloatArray | None = None,
    ) -> None:
        """Log a motion of the hand that starts now.

        Args:
            names: Joint names, n_q of them.
            times_s: Times from the motion's start, ascending, shape (t,).
            joints: Joint positions, shape (t, n_q), rad.
            transform_palm_to_world: Poses of the palm, shape (t, 4, 4).
            skeletons: Points along each finger in the world, shape (t, n_fingers, points, 3).
            transform_object_to_world: Poses of the object, shape (t, 4, 4).
        """
        if not keeps(self.parameters.level, "/joints"):
            return
        start = self._time_ns
        for k, offset in enumerate(times_s):
            self._time_ns = start + round(float(offset) * 1e9)
            stamp = messages.timestamp(self._time_ns)
            states = [JointState(name=n, position=float(q)) for n, q in zip(names, joints[k], strict=True)]
            self._put("/joints", JointStates(timestamp=stamp, joints=states))
            frames = []
            if transform_palm_to_world is not None:
                frames.append(
                    messages.frame_transform(self._time_ns, "world", "palm", transform_palm_to_world[k])
                )
            if transform_object_to_world is not None:
                frames.append(
                    messages.frame_transform(self._time_ns, "world", "object", transform_object_to_world[k])
                )
            if frames:
                self._put("/tf", FrameTransforms(transforms=frames))
            if skeletons is not None:
                lines = [messages.line(finger, HAND, 0.012) for finger in skeletons[k]]
                self._put("/hand", messages.scene(self._time_ns, "hand", lines=lines))
        self._end_chunk()

    def motion(self, names: Sequence[str], motion: Motion) -> None:
        """Log what was executed: joints, palm and object, from now on."""
        if not keeps(self.parameters.level, "/joints"):
            return
        self.joints(
            names,
            motion.times_s,
            motion.joints,
            motion.transform_palm_to_world,
            transform_object_to_world=motion.transform_object_to_world,
        )

    def _silhouette(self, silhouette: Silhouette) -> None:
        u_min, v_min, u_max, v_max = (float(value) for value in silhouette.box)
        box = np.array([[u_min, v_min], [u_max, v_min], [u_max, v_max], [u_min, v_max]])
        outlines = [(outline, OUTLINE) for outline in outlines_of(silhouette.image_mask)]
        annotations = messages.image_polygons(self._time_ns, [*outlines, (box, BOX)])
        self._put("/camera/annotations", annotations)
        self._put(
            "/camera/silhouette", messages.compressed_image(self._time_ns, silhouette.image_mask, "png")
        )

    def _surface(self, surface: Surface) -> None:
        mesh = messages.triangles(surface.points, surface.network.faces, SURFACE)
        self._put("/surface/mesh", messages.scene(self._time_ns, "surface", triangles=[mesh]))
        if surface.at_rest:
            cloud = messages.point_cloud(self._time_ns, surface.points, surface.normals)
            self._put("/surface/points", cloud)
        self._end_chunk()

    def _flush_skipped(self) -> None:
        if self._skipped is not None:
            self._surface(self._skipped)

    def _advance(self, duration_s: float) -> None:
        self._time_ns += round(duration_s * 1e9)

    def _put(self, topic: str, message: Any) -> None:
        if self._file is not None and keeps(self.parameters.level, topic):
            self._file.add(topic, message, self._time_ns)

    def _end_chunk(self) -> None:
        if self._file is not None:
            self._file.end_chunk()


def outlines_of(mask: BoolArray) -> list[FloatArray]:
    """Return the outer outlines of a mask in continuous image coordinates, each of shape (n, 2)."""
    # Pixel centres are at half coordinates.
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_TC89_L1)
    return [contour[:, 0, :].astype(np.float64) + 0.5 for contour in contours]


def _json_scalar(value: Any) -> Any:
    if isinstance(value, (bool, str, int)) or value is None:
        return value
    number = float(value)
    return number if np.isfinite(number) else None
