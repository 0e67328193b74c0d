"""A film of an execution: what happened, played again before PyBullet's camera."""

import math
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self
from xml.etree import ElementTree

import cv2
import numpy as np
from PIL import Image

from graspbench.arrays import FloatArray, ImageArray
from graspbench.hand.model import HandModel
from graspbench.perception.camera import Intrinsics, look_at
from graspbench.quiet import captured_output
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.bullet_exchange import pose_of, quaternion_of, write_obj
from graspbench.simulation.colours import scene_colours
from graspbench.simulation.execution_result import Motion
from graspbench.simulation.mounts.urdf import hand_robot
from graspbench.simulation.renderer import projection_matrix, view_matrix
from graspbench.simulation.scene import SceneParameters

if TYPE_CHECKING:
    from graspbench.geometry.model import ObjectModel

FILM = "execution"
"""Name of the film's file, without its suffix."""

_SIZE = (400, 300)
_FRAMES_PER_S = 10.0
_MAX_FRAMES = 90  # what lasts longer is shown faster: so the cost is bounded
_FIELD_DEG = 34.0
_ELEVATION_DEG = 22.0
_ROOM_M = 0.09  # around what moves: the hand's own size
_TABLE_HALF_M = 0.6
_CODECS = (("vp09", ".mp4"),)  # VP9 in MP4: browsers play it, and OpenCV's own FFmpeg writes it


def film_execution(
    folder: Path, model: "ObjectModel", scene: SceneParameters, hand: HandModel, motion: Motion
) -> Path:
    """Film an execution and return the file: ``execution.mp4``, or a GIF where no encoder is at hand.

    The sampled motion is played in a world of its own, so nothing in the physics depends on being filmed. Of
    what carries the hand only the hand itself is shown.

    Args:
        folder: Where the film goes.
        model: The object.
        scene: Light and colours.
        hand: The hand.
        motion: What happened.
    """
    shown, rate = _frames(motion.times_s)
    with _Stage(model, scene, hand, _camera(motion)) as stage:
        images = (stage.image(motion, int(k)) for k in shown)
        return _written(images, rate, folder)


def _frames(times_s: FloatArray) -> tuple[FloatArray, float]:
    """Return which samples are shown, and how many a second."""
    length = float(times_s[-1] - times_s[0])
    count = min(max(int(length * _FRAMES_PER_S), 1) + 1, _MAX_FRAMES)
    wanted = np.linspace(times_s[0], times_s[-1], count)
    return np.searchsorted(times_s, wanted).clip(0, len(times_s) - 1), _FRAMES_PER_S


def _camera(motion: Motion) -> FloatArray:
    """Return the camera's pose, shape (4, 4): beside the way in, so far off that all stays in view."""
    palms, objects = motion.transform_palm_to_world, motion.transform_object_to_world
    seen = np.concatenate((palms[:, :3, 3], objects[:, :3, 3]))
    low, high = seen.min(axis=0), seen.max(axis=0)
    target = 0.5 * (low + high)
    radius = 0.5 * float(np.linalg.norm(high - low)) + _ROOM_M
    way = palms[0, :3, 2]
    azimuth = math.atan2(way[1], way[0]) + 0.5 * math.pi if np.hypot(way[0], way[1]) > 0.1 else 0.7
    elevation = math.radians(_ELEVATION_DEG)
    direction = np.array(
        [
            math.cos(elevation) * math.cos(azimuth),
            math.cos(elevation) * math.sin(azimuth),
            math.sin(elevation),
        ]
    )
    return look_at(target + radius / math.sin(math.radians(_FIELD_DEG / 2)) * direction, target)


class _Stage:
    """Table, object and hand in a world of PyBullet's without physics; a context manager."""

    def __init__(
        self, model: "ObjectModel", scene: SceneParameters, hand: HandModel, camera_to_world: FloatArray
    ) -> None:
        self._hand, self._scene = hand, scene
        self._client = pybullet.connect(pybullet.DIRECT)
        try:
            with tempfile.TemporaryDirectory(prefix="graspbench-") as folder, captured_output():
                self._add_table(scene_colours(scene, model.rgba).first)
                self._object = self._add_object(model, Path(folder))
                self._body = self._add_hand(Path(folder))
        except BaseException:
            self.close()
            raise
        joints = range(pybullet.getNumJoints(self._body, physicsClientId=self._client))
        infos = [pybullet.getJointInfo(self._body, i, physicsClientId=self._client) for i in joints]
        self._ids = {info[1].decode(): i for i, info in enumerate(infos)}
        dynamics = pybullet.getDynamicsInfo(self._body, -1, physicsClientId=self._client)
        self._inertial_to_root = pose_of(dynamics[3], dynamics[4])
        self._palm_to_root = np.linalg.inv(hand.transform_palm_to_root)
        width, height = _SIZE
        focal = 0.5 * min(_SIZE) / math.tan(math.radians(_FIELD_DEG / 2))
        self._projection = projection_matrix(
            Intrinsics(width, height, focal, focal, 0.5 * width, 0.5 * height), "tiny"
        )
        self._view = view_matrix(camera_to_world)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the world."""
        if self._client >= 0:
            pybullet.disconnect(physicsClientId=self._client)
            self._client = -1

    def image(self, motion: Motion, k: int) -> ImageArray:
        """Return what the camera sees at a sample of the motion, RGB, shape (h, w, 3)."""
        self._put(self._object, motion.transform_object_to_world[k])
        root = motion.transform_palm_to_world[k] @ self._palm_to_root
        self._put(self._body, root @ self._inertial_to_root)
        joints = dict(zip(self._hand.joint_names, motion.joints[k].tolist(), strict=True))
        for follower in self._hand.followers:
            joints[follower.name] = follower.ratio * joints[follower.leader] + follower.offset
        for name, value in joints.items():
            pybullet.resetJointState(self._body, self._ids[name], value, physicsClientId=self._client)
        scene = self._scene
        elevation, azimuth = math.radians(scene.light_elevation_deg), math.radians(scene.light_azimuth_deg)
        _, _, colours, _, _ = pybullet.getCameraImage(
            *_SIZE,
            viewMatrix=self._view,
            projectionMatrix=self._projection,
            lightDirection=[
                math.cos(elevation) * math.cos(azimuth),
                math.cos(elevation) * math.sin(azimuth),
                math.sin(elevation),
            ],
            shadow=1,
            lightAmbientCoeff=scene.ambient,
            lightDiffuseCoeff=scene.diffuse,
            lightSpecularCoeff=scene.specular,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        image: ImageArray = np.asarray(colours, dtype=np.uint8).reshape(_SIZE[1], _SIZE[0], 4)[..., :3]
        return image

    def _put(self, body: int, pose: FloatArray) -> None:
        pybullet.resetBasePositionAndOrientation(
            body, pose[:3, 3].tolist(), quaternion_of(pose), physicsClientId=self._client
        )

    def _add_table(self, colour: Sequence[float]) -> None:
        shape = pybullet.createVisualShape(
            pybullet.GEOM_BOX,
            halfExtents=[_TABLE_HALF_M, _TABLE_HALF_M, 0.01],
            rgbaColor=[*colour, 1.0],
            specularColor=[0, 0, 0],
            physicsClientId=self._client,
        )
        pybullet.createMultiBody(0.0, -1, shape, basePosition=[0.0, 0.0, -0.01], physicsClientId=self._client)

    def _add_object(self, model: "ObjectModel", folder: Path) -> int:
        mesh, path = model.mesh, folder / "object.obj"
        write_obj(path, [(mesh.vertices, mesh.faces)], mesh.vertex_normals)
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            fileName=str(path),
            rgbaColor=[*model.rgba[:3], 1.0],
            physicsClientId=self._client,
        )
        body: int = pybullet.createMultiBody(0.0, -1, shape, physicsClientId=self._client)
        return body

    def _add_hand(self, folder: Path) -> int:
        path = folder / "hand.urdf"
        path.write_text(ElementTree.tostring(hand_robot(self._hand)[0], encoding="unicode"), encoding="utf-8")
        body: int = pybullet.loadURDF(str(path), useFixedBase=True, physicsClientId=self._client)
        return body


def _written(images: Iterator[ImageArray], rate: float, folder: Path) -> Path:
    """Write images as a film, one after the other, in the first format that can be written here."""
    for codec, suffix in _CODECS:
        path = folder / f"{FILM}{suffix}"
        with captured_output():
            writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), rate, _SIZE)
            if writer.isOpened():
                for image in images:
                    writer.write(np.ascontiguousarray(image[..., ::-1]))
                writer.release()
                return path
        path.unlink(missing_ok=True)
    first, *others = [Image.fromarray(image).quantize(64, dither=Image.Dither.NONE) for image in images]
    path = folder / f"{FILM}.gif"
    first.save(path, save_all=True, append_images=others, duration=round(1e3 / rate), loop=0, optimize=False)
    return path
