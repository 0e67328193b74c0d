"""Hands described in MuJoCo's format, written as URDF: MuJoCo itself reads them."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import trimesh
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.quiet import captured_output

_UNLIMITED = np.pi
_MESHES = "meshes"
_FIELDS = (
    "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "geom_pos", "geom_quat",
    "geom_size", "jnt_pos", "jnt_axis", "jnt_range", "qpos0", "mesh_vert", "eq_data",
)  # fmt: skip


def urdf_of_mjcf(path: Path, name: str, folder: Path) -> Path:
    """Write a hand of MuJoCo's format as URDF with its collision meshes as STL.

    Bodies become links, hinges and slides joints; equality constraints between two joints become ``mimic``.
    Only shapes that collide are kept. A free joint at the root is left out: the wrist is the program's.

    Args:
        path: The MJCF file.
        name: What to call the hand.
        folder: Where to write.

    Returns:
        The URDF.

    Raises:
        HandError: MuJoCo is not installed, cannot read the file, or it closes loops of links.
    """
    try:
        with captured_output():
            import mujoco
    except ImportError as error:
        raise HandError(
            f"'{path.name}' is in MuJoCo's format, whose reader is not installed",
            remedy="install it with 'pip install mujoco', or take the hand's URDF",
        ) from error
    try:
        with captured_output():
            model = mujoco.MjModel.from_xml_path(str(path))
    except Exception as error:
        said = str(error).strip().splitlines()
        raise HandError(
            f"MuJoCo cannot read '{path}' of hand '{name}' ({said[0] if said else type(error).__name__})",
            remedy="check the file and the meshes that it names",
            path=str(path),
        ) from error
    for field in _FIELDS:
        if not np.all(np.isfinite(getattr(model, field))):
            raise HandError(
                f"MuJoCo reads no finite numbers as {field} from '{path}' of hand '{name}'",
                remedy="check the numbers in the file and in the meshes that it names",
                path=str(path),
            )
    robot = _Writer(mujoco, model, name, folder).robot()
    target = folder / f"{name}.urdf"
    ElementTree.indent(robot)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(ElementTree.tostring(robot, encoding="unicode") + "\n", encoding="utf-8")
    return target


class _Writer:
    """Writes one model's links and joints."""

    def __init__(self, mujoco: Any, model: Any, name: str, folder: Path) -> None:
        self._mj, self._model, self._name, self._folder = mujoco, model, name, folder
        self._meshes: dict[int, str] = {}
        self._links = self._named(mujoco.mjtObj.mjOBJ_BODY, model.nbody, "body")
        self._joints = self._named(mujoco.mjtObj.mjOBJ_JOINT, model.njnt, "joint")
        self._collides = [
            bool(model.geom_contype[g] or model.geom_conaffinity[g]) for g in range(model.ngeom)
        ]
        self._followers = self._equalities()

    def robot(self) -> ElementTree.Element:
        """Return the whole hand."""
        robot = ElementTree.Element("robot", name=self._name)
        model = self._model
        roots = [b for b in range(1, model.nbody) if model.body_parentid[b] == 0]
        bodies = set(roots)
        if len(roots) > 1 or any(self._collides[g] and model.geom_bodyid[g] == 0 for g in range(model.ngeom)):
            bodies = {0}
        for b in range(1, model.nbody):
            if model.body_parentid[b] in bodies:
                bodies.add(b)
        for b in sorted(bodies):
            self._body(robot, b, is_root=b == 0 or (b in roots and 0 not in bodies))
        return robot

    def _named(self, kind: Any, count: int, word: str) -> list[str]:
        names = [self._mj.mj_id2name(self._model, kind, i) or f"{word}_{i}" for i in range(count)]
        return [re.sub(r"[^\w.-]", "_", each) for each in names]

    def _equalities(self) -> dict[int, tuple[int, float, float]]:
        """Return leader, ratio and offset by joint."""
        found: dict[int, tuple[int, float, float]] = {}
        model = self._model
        for e in range(model.neq):
            kind = int(model.eq_type[e])
            if not model.eq_active0[e]:
                continue
            if kind == int(self._mj.mjtEq.mjEQ_JOINT) and model.eq_obj2id[e] >= 0:
                one, two = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
                constant, ratio = (float(value) for value in model.eq_data[e][:2])
                start = [float(model.qpos0[model.jnt_qposadr[j]]) for j in (one, two)]
                if one not in found and two not in found:
                    found[one] = (two, ratio, start[0] + constant - ratio * start[1])
            elif kind in (int(self._mj.mjtEq.mjEQ_CONNECT), int(self._mj.mjtEq.mjEQ_WELD)):
                raise HandError(
                    f"hand '{self._name}' closes a loop of links (an equality of kind "
                    f"{'connect' if kind == int(self._mj.mjtEq.mjEQ_CONNECT) else 'weld'})",
                    remedy="take a file whose coupled joints follow each other (URDF: mimic) instead",
                )
        return found

    def _body(self, robot: ElementTree.Element, b: int, *, is_root: bool) -> None:
        model, link = self._model, self._links[b]
        joints = range(model.body_jntadr[b], model.body_jntadr[b] + model.body_jntnum[b])
        kinds = [int(model.jnt_type[j]) for j in joints]
        moving = [int(self._mj.mjtJoint.mjJNT_HINGE), int(self._mj.mjtJoint.mjJNT_SLIDE)]
        if not is_root:
            pose = _pose(model.body_pos[b], model.body_quat[b])
            before = self._links[model.body_parentid[b]]
            for j, kind in zip(joints, kinds, strict=True):
                if kind not in moving:
                    raise HandError(
                        f"joint '{self._joints[j]}' of hand '{self._name}' is a ball or free joint",
                        remedy="take a file with hinges and slides only",
                        joint=self._joints[j],
                    )
                at = np.array(model.jnt_pos[j], dtype=float)
                # The last joint carries the body itself where it turns about the body's origin.
                direct = j == joints[-1] and bool(np.linalg.norm(at) < 1e-9)
                own = link if direct else f"{link}_{self._joints[j]}_axis"
                self._joint(robot, j, kind, before, own, pose @ _shift(at))
                pose, before = _shift(-at), own
                if not direct:
                    ElementTree.SubElement(robot, "link", name=own)
            if before != link:
                self._connect(robot, f"{link}_mount", "fixed", before, link, pose)
        element = ElementTree.SubElement(robot, "link", name=link)
        if b > 0:
            self._inertial(element, b)
        for g in range(model.body_geomadr[b], model.body_geomadr[b] + model.body_geomnum[b]):
            if self._collides[g]:
                self._shape(element, g)

    def _joint(
        self, robot: ElementTree.Element, j: int, kind: int, parent: str, child: str, pose: FloatArray
    ) -> None:
        model = self._model
        slides = kind == int(self._mj.mjtJoint.mjJNT_SLIDE)
        joint = self._connect(
            robot, self._joints[j], "prismatic" if slides else "revolute", parent, child, pose
        )
        axis = np.array(model.jnt_axis[j], dtype=float)
        ElementTree.SubElement(joint, "axis", xyz=_numbers(axis / np.linalg.norm(axis)))
        start = float(model.qpos0[model.jnt_qposadr[j]])
        low, high = (float(value) - start for value in model.jnt_range[j])
        if not model.jnt_limited[j]:
            low, high = (-0.05, 0.05) if slides else (-_UNLIMITED, _UNLIMITED)
        limit = {"lower": f"{low:.12g}", "upper": f"{high:.12g}", "effort": f"{self._effort(j):.6g}"}
        ElementTree.SubElement(joint, "limit", limit, velocity="0")
        if j in self._followers:
            leader, ratio, offset = self._followers[j]
            shift = ratio * float(model.qpos0[model.jnt_qposadr[leader]]) - start
            ElementTree.SubElement(
                joint,
                "mimic",
                joint=self._joints[leader],
                multiplier=f"{ratio:.12g}",
                offset=f"{offset + shift:.12g}",
            )

    def _effort(self, j: int) -> float:
        """Return a joint's largest force or torque; 0 where the file gives none."""
        model = self._model
        if model.jnt_actfrclimited[j]:
            return float(np.abs(model.jnt_actfrcrange[j]).max())
        for a in range(model.nu):
            on_joint = model.actuator_trntype[a] == int(self._mj.mjtTrn.mjTRN_JOINT)
            if on_joint and model.actuator_trnid[a, 0] == j and model.actuator_forcelimited[a]:
                return float(np.abs(model.actuator_forcerange[a]).max() * abs(model.actuator_gear[a, 0]))
        return 0.0

    def _inertial(self, link: ElementTree.Element, b: int) -> None:
        model, mass = self._model, float(self._model.body_mass[b])
        if mass <= 0.0:
            return
        inertial = ElementTree.SubElement(link, "inertial")
        _origin(inertial, _pose(model.body_ipos[b], model.body_iquat[b]))
        ElementTree.SubElement(inertial, "mass", value=f"{mass:.12g}")
        ixx, iyy, izz = (f"{float(value):.12g}" for value in model.body_inertia[b])
        ElementTree.SubElement(inertial, "inertia", ixx=ixx, iyy=iyy, izz=izz, ixy="0", ixz="0", iyz="0")

    def _shape(self, link: ElementTree.Element, g: int) -> None:
        model, kinds = self._model, self._mj.mjtGeom
        kind, size = int(model.geom_type[g]), np.array(model.geom_size[g], dtype=float)
        pose = _pose(model.geom_pos[g], model.geom_quat[g])
        if kind == int(kinds.mjGEOM_BOX):
            _collision(link, pose, "box", size=_numbers(2.0 * size))
        elif kind == int(kinds.mjGEOM_SPHERE):
            _collision(link, pose, "sphere", radius=f"{size[0]:.12g}")
        elif kind in (int(kinds.mjGEOM_CAPSULE), int(kinds.mjGEOM_CYLINDER)):
            _collision(link, pose, "cylinder", radius=f"{size[0]:.12g}", length=f"{2 * size[1]:.12g}")
            if kind == int(kinds.mjGEOM_CAPSULE):
                for side in (-1.0, 1.0):
                    end = pose @ _shift(np.array([0.0, 0.0, side * size[1]]))
                    _collision(link, end, "sphere", radius=f"{size[0]:.12g}")
        elif kind == int(kinds.mjGEOM_ELLIPSOID):
            ball = trimesh.creation.icosphere(subdivisions=2)
            ball.apply_scale(size)
            self._mesh_file(link, pose, ball, f"{self._links[model.geom_bodyid[g]]}_{g}")
        elif kind == int(kinds.mjGEOM_MESH):
            self._mesh(link, pose, int(model.geom_dataid[g]))

    def _mesh(self, link: ElementTree.Element, pose: FloatArray, m: int) -> None:
        model = self._model
        first, count = int(model.mesh_vertadr[m]), int(model.mesh_vertnum[m])
        faces, many = int(model.mesh_faceadr[m]), int(model.mesh_facenum[m])
        mesh = trimesh.Trimesh(
            np.array(model.mesh_vert[first : first + count], dtype=float),
            np.array(model.mesh_face[faces : faces + many], dtype=np.int64),
        )
        name = self._mj.mj_id2name(model, self._mj.mjtObj.mjOBJ_MESH, m) or f"mesh_{m}"
        self._mesh_file(link, pose, mesh.convex_hull, re.sub(r"[^\w.-]", "_", name))

    def _mesh_file(
        self, link: ElementTree.Element, pose: FloatArray, mesh: trimesh.Trimesh, name: str
    ) -> None:
        path = self._folder / _MESHES / f"{name}.stl"
        path.parent.mkdir(parents=True, exist_ok=True)
        mesh.export(path)
        _collision(link, pose, "mesh", filename=f"{_MESHES}/{name}.stl")

    def _connect(
        self, robot: ElementTree.Element, name: str, kind: str, parent: str, child: str, pose: FloatArray
    ) -> ElementTree.Element:
        joint = ElementTree.SubElement(robot, "joint", name=name, type=kind)
        _origin(joint, pose)
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        return joint


def _pose(position: FloatArray, quaternion: FloatArray) -> FloatArray:
    w, x, y, z = (float(value) for value in quaternion)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat([x, y, z, w]).as_matrix()
    pose[:3, 3] = position
    return pose


def _shift(by: FloatArray) -> FloatArray:
    pose = np.eye(4)
    pose[:3, 3] = by
    return pose


def _origin(element: ElementTree.Element, pose: FloatArray) -> None:
    rpy = pinocchio.rpy.matrixToRpy(pose[:3, :3])
    ElementTree.SubElement(element, "origin", xyz=_numbers(pose[:3, 3]), rpy=_numbers(rpy))


def _collision(link: ElementTree.Element, pose: FloatArray, kind: str, **attributes: str) -> None:
    collision = ElementTree.SubElement(link, "collision")
    _origin(collision, pose)
    ElementTree.SubElement(ElementTree.SubElement(collision, "geometry"), kind, attributes)


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{float(value):.12g}" for value in values)
