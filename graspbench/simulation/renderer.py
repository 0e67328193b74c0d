"""PyBullet's camera as an exact pinhole, for the software renderer and for OpenGL."""

import tempfile
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

import cv2
import numpy as np
import numpy.typing as npt

from graspbench.arrays import FloatArray, ImageArray
from graspbench.errors import SimulationError
from graspbench.perception.camera import Intrinsics
from graspbench.quiet import captured_output
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.bullet_exchange import quaternion_of, write_obj
from graspbench.simulation.scene import SceneParameters

if TYPE_CHECKING:
    from graspbench.geometry.model import ObjectModel

IntImage = npt.NDArray[np.int32]

_NEAR_M = 0.02
_FAR_M = 10.0
_LIGHT_DISTANCE_M = 2.0


class Renderer:
    """Draws one object as a pinhole camera sees it, in a PyBullet world of its own.

    PyBullet's OpenGL plug-in must be loaded before any body, and whatever else is in the world costs
    time; so rendering does not share the world of the physics.

    Args:
        object_model: The object.
        object_to_world: Its pose, shape (4, 4).
        scene: Renderer and light.
        table_texture: Image of the table top for full rendering, or None for the object alone.
        table_size_m: Side of the square table top.

    Attributes:
        name: The renderer in use, "tiny" or "egl".
        object_body: The object's number in what `render` returns.

    Raises:
        SimulationError: ``scene.renderer`` is "egl" and EGL does not load.
    """

    def __init__(
        self,
        object_model: "ObjectModel",
        object_to_world: FloatArray,
        scene: SceneParameters,
        table_texture: ImageArray | None = None,
        table_size_m: float = 0.0,
    ) -> None:
        self._scene = scene
        self._object_vertices = np.asarray(object_model.mesh.vertices)
        self._vertices = self._object_vertices @ object_to_world[:3, :3].T + object_to_world[:3, 3]
        self._folder = tempfile.TemporaryDirectory(prefix="graspbench-")
        self._client = pybullet.connect(pybullet.DIRECT)
        self._plugin = -1
        try:
            if scene.renderer != "tiny":
                self._plugin = _load_egl(self._client)
                if self._plugin < 0 and scene.renderer == "egl":
                    raise SimulationError(
                        "PyBullet's EGL renderer does not load on this machine",
                        remedy="install libEGL, or choose scene.renderer=tiny",
                    )
            self.name = "tiny" if self._plugin < 0 else "egl"
            with captured_output():
                self.object_body = self._add_object(object_model, object_to_world)
                if table_texture is not None:
                    self._add_table(table_texture, table_size_m)
                if self.name == "egl":  # its first two images come with greetings on standard output
                    for _ in range(2):
                        self.render(Intrinsics(8, 8, 8.0, 8.0, 4.0, 4.0), np.eye(4))
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the world and its files; closing twice does no harm."""
        if self._client >= 0:
            with captured_output():
                pybullet.disconnect(physicsClientId=self._client)
            self._client = -1
        self._folder.cleanup()

    def move(self, object_to_world: FloatArray, scene: SceneParameters) -> None:
        """Put the object elsewhere, shape (4, 4), into another light."""
        self._scene = scene
        self._vertices = self._object_vertices @ object_to_world[:3, :3].T + object_to_world[:3, 3]
        pybullet.resetBasePositionAndOrientation(
            self.object_body,
            object_to_world[:3, 3].tolist(),
            quaternion_of(object_to_world),
            physicsClientId=self._client,
        )

    def render(self, intrinsics: Intrinsics, camera_to_world: FloatArray) -> tuple[ImageArray, IntImage]:
        """Draw all there is.

        Args:
            intrinsics: Pinhole parameters; distortion is ignored.
            camera_to_world: Pose of the optical frame, shape (4, 4).

        Returns:
            RGB image, shape (h, w, 3), and the number of the body that each pixel shows, -1 for none,
            shape (h, w).
        """
        scene, k = self._scene, intrinsics
        elevation, azimuth = np.radians((scene.light_elevation_deg, scene.light_azimuth_deg))
        _, _, colours, _, bodies = pybullet.getCameraImage(
            k.width,
            k.height,
            viewMatrix=view_matrix(camera_to_world),
            projectionMatrix=projection_matrix(k, self.name),
            lightDirection=[
                float(np.cos(elevation) * np.cos(azimuth)),
                float(np.cos(elevation) * np.sin(azimuth)),
                float(np.sin(elevation)),
            ],
            lightDistance=_LIGHT_DISTANCE_M,
            shadow=int(scene.full_rendering and scene.shadow > 0.0),
            lightAmbientCoeff=scene.ambient,
            lightDiffuseCoeff=scene.diffuse,
            lightSpecularCoeff=scene.specular,
            renderer=(
                pybullet.ER_TINY_RENDERER if self.name == "tiny" else pybullet.ER_BULLET_HARDWARE_OPENGL
            ),
            physicsClientId=self._client,
        )
        shape = (k.height, k.width)
        image = np.asarray(colours, dtype=np.uint8).reshape(*shape, 4)[..., :3]
        return image, np.asarray(bodies, dtype=np.int32).reshape(shape)

    def window(
        self, intrinsics: Intrinsics, camera_to_world: FloatArray, margin: int
    ) -> tuple[int, int, int, int] | None:
        """Return first row, end row, first column, end column of the pixels around the object.

        None: it is out of view. The whole image: some of it is beside or behind the camera.
        """
        k = intrinsics
        local = (self._vertices - camera_to_world[:3, 3]) @ camera_to_world[:3, :3]
        if local[:, 2].max() <= _NEAR_M:
            return None
        if local[:, 2].min() <= _NEAR_M:
            return 0, k.height, 0, k.width
        u = k.fx * local[:, 0] / local[:, 2] + k.cx
        v = k.fy * local[:, 1] / local[:, 2] + k.cy
        top, bottom = max(int(np.floor(v.min())) - margin, 0), min(int(np.ceil(v.max())) + margin, k.height)
        left, right = max(int(np.floor(u.min())) - margin, 0), min(int(np.ceil(u.max())) + margin, k.width)
        return (top, bottom, left, right) if top < bottom and left < right else None

    def _add_object(self, model: "ObjectModel", object_to_world: FloatArray) -> int:
        path = Path(self._folder.name) / "object.obj"
        mesh = model.mesh
        write_obj(path, [(mesh.vertices, mesh.faces)], mesh.vertex_normals)
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            fileName=str(path),
            rgbaColor=[*model.rgba[:3], 1.0],
            specularColor=[1.0, 1.0, 1.0],
            physicsClientId=self._client,
        )
        body: int = pybullet.createMultiBody(
            0.0,
            -1,
            shape,
            basePosition=object_to_world[:3, 3].tolist(),
            baseOrientation=quaternion_of(object_to_world),
            physicsClientId=self._client,
        )
        return body

    def _add_table(self, texture: ImageArray, size_m: float) -> None:
        """Add the table top as a textured square."""
        folder, half = Path(self._folder.name), size_m / 2.0
        cv2.imwrite(str(folder / "table.png"), texture[..., ::-1])
        corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
        # The texture's first row is at -y, as in the computed table.
        lines = [f"v {x:.9g} {y:.9g} 0" for x, y in corners]
        lines += ["vt 0 1", "vt 1 1", "vt 1 0", "vt 0 0", "vn 0 0 1"]
        lines += ["f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1"]
        (folder / "table.obj").write_text("\n".join(lines) + "\n", encoding="ascii")
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            fileName=str(folder / "table.obj"),
            rgbaColor=[1, 1, 1, 1],
            specularColor=[0, 0, 0],
            physicsClientId=self._client,
        )
        body = pybullet.createMultiBody(0.0, -1, shape, physicsClientId=self._client)
        image = pybullet.loadTexture(str(folder / "table.png"), physicsClientId=self._client)
        pybullet.changeVisualShape(body, -1, textureUniqueId=image, physicsClientId=self._client)


def projection_matrix(intrinsics: Intrinsics, renderer: str) -> list[float]:
    """Return OpenGL's projection matrix, column by column, that makes a renderer this exact pinhole.

    OpenGL samples a pixel at its centre. PyBullet's software renderer samples at whole numbers of a
    raster with its origin at the lower left, that is half a pixel to the left of and below the centre
    of the pixel; the principal point is moved alike.
    """
    k = intrinsics
    cx, cy = (k.cx - 0.5, k.cy + 0.5) if renderer == "tiny" else (k.cx, k.cy)
    depth = _FAR_M - _NEAR_M
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[0, 2] = 2.0 * k.fx / k.width, 1.0 - 2.0 * cx / k.width
    matrix[1, 1], matrix[1, 2] = 2.0 * k.fy / k.height, 2.0 * cy / k.height - 1.0
    matrix[2, 2], matrix[2, 3] = -(_FAR_M + _NEAR_M) / depth, -2.0 * _FAR_M * _NEAR_M / depth
    matrix[3, 2] = -1.0
    columns: list[float] = matrix.T.ravel().tolist()
    return columns


def view_matrix(camera_to_world: FloatArray) -> list[float]:
    """Return OpenGL's view matrix (x right, y up, looking along -z), column by column."""
    to_camera = np.linalg.inv(camera_to_world)
    to_camera[1:3] *= -1.0
    columns: list[float] = to_camera.T.ravel().tolist()
    return columns


def _load_egl(client: int) -> int:
    """Load PyBullet's OpenGL plug-in; return its number, negative if it does not load."""
    spec = find_spec("eglRenderer")
    if spec is None or spec.origin is None:
        return -1
    with captured_output():
        plugin: int = pybullet.loadPlugin(spec.origin, "_eglRendererPlugin", physicsClientId=client)
    return plugin
