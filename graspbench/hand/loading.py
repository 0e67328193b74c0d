"""Loading a hand: from its description and its URDF to a hand model."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import HandError
from graspbench.hand import shapes
from graspbench.hand.chains import (
    PREFERRED,
    VECTOR_OFFSET,
    VECTOR_RATIO,
    Chains,
    coupling,
    extract_chains,
    joint_units,
)
from graspbench.hand.completion import add_tip_spheres, completed_description
from graspbench.hand.files import find_urdf, write_urdf
from graspbench.hand.model import Follower, HandModel, shape_poses
from graspbench.hand.parameters import FingerDescription, HandParameters, PalmDescription
from graspbench.hand.radial import describe_radial, radial_urdf
from graspbench.hand.tip_surfaces import with_surfaces
from graspbench.hand.touching import with_pads
from graspbench.quiet import captured_output

_DRAWN_POSTURES = 8
_FLAT_M = 1e-6


def load_hand(parameters: HandParameters) -> HandModel:
    """Load a hand; the same parameters give the same object.

    Args:
        parameters: The hand's description.

    Raises:
        HandError: The URDF is missing or unreadable, or does not fit its description.
    """
    return _load(_Key(parameters))


class _Key:
    """Makes parameters hashable by value, for the cache (a field may hold a dict)."""

    def __init__(self, parameters: HandParameters) -> None:
        self.parameters = parameters
        self._text = repr(parameters)

    def __hash__(self) -> int:
        return hash(self._text)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._text == other._text


@lru_cache(maxsize=16)
def _load(key: _Key) -> HandModel:
    parameters = key.parameters
    package_dirs: tuple[Path, ...]
    robot: ElementTree.Element | None = None
    if parameters.kind == "radial":
        if parameters.tip_shape == "link":
            raise HandError(
                f"the tips of the radial hand '{parameters.name}' are spheres",
                remedy="set hand.tip_shape=sphere, or hand.kind=urdf",
            )
        path = write_urdf(radial_urdf(parameters), "radial")
        package_dirs = (path.parent,)
        palm, fingers = describe_radial(parameters)
    else:
        source, package_dirs = find_urdf(parameters.urdf, parameters.package_dirs, parameters.name)
        robot, fingers = completed_description(source, package_dirs, parameters)
        path, palm = write_urdf(_text(robot), source.stem), parameters.palm
    used = _choose(parameters, fingers)
    meshes = coal.CachedMeshLoader()
    model, geometry = read_urdf(path, package_dirs, parameters.name, meshes)
    transform = _palm_placement(model, palm, parameters.name)
    # All fingers are read, so that an idle one is checked and known to rest.
    extract_chains(model, transform, fingers, parameters.name)
    chains, frames = extract_chains(model, transform, used, parameters.name)
    as_link = parameters.tip_shape == "link"
    if as_link:
        names = tuple(finger.name for finger in used)
        chains = with_surfaces(chains, geometry, frames, parameters.tip_radius_m, names, parameters.name)
    bare = shapes.bare_tips(geometry, frames, chains.tips, chains.counts, parameters.tip_radius_m)
    if bare and robot is not None and not as_link:
        add_tip_spheres(robot, [used[f] for f in bare], parameters.tip_radius_m)
        path = write_urdf(_text(robot), path.stem.rsplit("_", 1)[0])
        model, geometry = read_urdf(path, package_dirs, parameters.name, meshes)
    rest = _rest(model, fingers)
    preferred = _preferred(rest, chains)
    data = model.createData()
    pinocchio.forwardKinematics(model, data, preferred)
    found = shapes.extract_shapes(
        model, geometry, data, transform, frames, chains.tips, chains.counts, tips_are_links=as_link
    )
    found = shapes.with_pairs(
        found,
        shape_poses(chains, found, np.ascontiguousarray(chains.limits[..., PREFERRED])),
        [shape_poses(chains, found, rows) for rows in _drawn_rows(chains, model)],
    )
    loaded = HandModel(
        name=parameters.name,
        finger_names=tuple(finger.name for finger in used),
        joint_names=tuple(model.names[j] for j in range(1, model.njoints) if model.joints[j].nq == 1),
        followers=_followers(model),
        lower=np.array(model.lowerPositionLimit),
        upper=np.array(model.upperPositionLimit),
        velocity_limits=np.array(model.velocityLimit),
        effort_limits=np.array(model.effortLimit),
        preferred=preferred,
        rest=rest,
        tip_radius_m=0.0 if as_link else parameters.tip_radius_m,
        pad_radius_m=parameters.tip_radius_m,
        tip_links=tuple(finger.tip for finger in used),
        palm_link=palm.link,
        urdf_path=path,
        package_dirs=package_dirs,
        transform_palm_to_root=np.array(transform.homogeneous),
        symmetric=parameters.kind == "radial",
        margins=parameters.margins,
        model=model,
        geometry=geometry,
        chains=chains,
        chain_joints=_chain_joints(frames, len(used)),
        freedom=np.full(len(used), 3, dtype=np.int64),
        shapes=found,
        file_frames=parameters.formats,
        bare_tips=() if as_link or robot is None else tuple(used[f].name for f in bare),
    )
    if as_link:
        loaded = with_pads(loaded)
    return replace(loaded, freedom=_freedom(loaded))


def _text(robot: ElementTree.Element) -> str:
    return ElementTree.tostring(robot, encoding="unicode")


def _drawn_rows(chains: Chains, model: pinocchio.Model) -> list[FloatArray]:
    """Return some postures from all over the joints' ranges, by finger, shape (f, k) each."""
    generator, lower, upper = np.random.default_rng(0), model.lowerPositionLimit, model.upperPositionLimit
    drawn = lower + generator.uniform(0.0, 1.0, (_DRAWN_POSTURES, model.nq)) * (upper - lower)
    ratios, offsets = chains.limits[..., VECTOR_RATIO], chains.limits[..., VECTOR_OFFSET]
    return [np.ascontiguousarray(q[chains.index] * ratios + offsets) for q in drawn]


def _freedom(hand: HandModel) -> IntArray:
    """Return in how many directions each finger moves its tip by itself, whatever the posture."""
    generator = np.random.default_rng(0)
    shares = generator.uniform(0.1, 0.9, (_DRAWN_POSTURES, hand.n_joints))
    drawn = hand.lower + shares * (hand.upper - hand.lower)
    jacobians = np.stack([hand.tip_jacobians(joints) for joints in drawn])
    largest = np.linalg.svd(jacobians, compute_uv=False).max(axis=0)
    freedom = np.sum(largest >= _FLAT_M, axis=1)
    if np.any(still := freedom == 0):
        name = hand.finger_names[int(np.flatnonzero(still)[0])]
        raise HandError(
            f"the joints of finger '{name}' of hand '{hand.name}' do not move the centre of its tip",
            remedy="set the finger's tip_xyz_m, or name another tip link",
            finger=name,
        )
    return np.asarray(freedom, dtype=np.int64)


def _followers(model: pinocchio.Model) -> tuple[Follower, ...]:
    names = {int(joint.idx_q): model.names[j] for j, joint in enumerate(model.joints) if j and joint.nq == 1}
    return tuple(
        Follower(model.names[j], names[int(joint.idx_q)], *coupling(model, j))
        for j, joint in enumerate(model.joints)
        if j and joint.nq == 0
    )


def _chain_joints(
    frames: dict[int, tuple[int, int, pinocchio.SE3]], n_fingers: int
) -> tuple[tuple[int, ...], ...]:
    rows: list[list[int]] = [[] for _ in range(n_fingers)]
    for joint, (finger, _, _) in frames.items():
        rows[finger].append(joint)
    return tuple(tuple(row) for row in rows)


def _preferred(rest: FloatArray, chains: Chains) -> FloatArray:
    """Return the preferred joints of a grasp; idle joints at rest."""
    preferred = rest.copy()
    for f, count in enumerate(chains.counts):
        limits = chains.limits[f, :count]
        preferred[chains.index[f, :count]] = (limits[:, PREFERRED] - limits[:, VECTOR_OFFSET]) / limits[
            :, VECTOR_RATIO
        ]
    return preferred


def _choose(
    parameters: HandParameters, fingers: tuple[FingerDescription, ...]
) -> tuple[FingerDescription, ...]:
    names = [finger.name for finger in fingers]
    wanted = parameters.fingers
    if len(set(names)) != len(names):
        raise HandError(f"hand '{parameters.name}' has two fingers of one name", remedy="rename one")
    if wanted > len(fingers):
        raise HandError(
            f"hand '{parameters.name}' has {len(fingers)} fingers, {wanted} are asked for",
            remedy=f"set hand.fingers to at most {len(fingers)}",
            fingers=wanted,
        )
    chosen = parameters.subsets.get(wanted, tuple(names[:wanted]))
    if len(chosen) != wanted or not set(chosen) <= set(names):
        raise HandError(
            f"subset {wanted} of hand '{parameters.name}' lists {', '.join(chosen)}",
            remedy=f"list {wanted} of {', '.join(names)}",
        )
    return tuple(fingers[names.index(name)] for name in chosen)


def read_urdf(
    path: Path, package_dirs: tuple[Path, ...], hand: str, meshes: coal.MeshLoader | None = None
) -> tuple[Any, Any]:
    """Read Pinocchio's model and collision geometry from a completed URDF.

    Args:
        path: The URDF.
        package_dirs: Folders to look for ``package://`` files in.
        hand: Name of the hand, for error messages.
        meshes: What reads the meshes; one that keeps them reads them once for two descriptions of a hand.

    Raises:
        HandError: The file or one of its meshes cannot be read, or a joint is none that moves a finger.
    """
    folders = [str(folder) for folder in package_dirs]
    try:
        with captured_output():
            model = pinocchio.buildModelFromUrdf(str(path), mimic=True)
            geometry = pinocchio.buildGeomFromUrdf(
                model,
                str(path),
                pinocchio.GeometryType.COLLISION,
                package_dirs=folders,
                mesh_loader=meshes or coal.MeshLoader(),
            )
    except (ValueError, RuntimeError) as error:
        said = str(error).strip()
        meshes = [mesh.get("filename", "") for mesh in ElementTree.parse(path).getroot().iter("mesh")]
        if broken := [mesh for mesh in meshes if mesh in said]:
            raise HandError(
                f"the collision mesh '{broken[0]}' of hand '{hand}' cannot be read",
                remedy="save it as STL, OBJ or DAE",
                mesh=broken[0],
            ) from error
        raise HandError(
            f"the URDF '{path}' of hand '{hand}' cannot be read ({said.splitlines()[-1]})",
            remedy="check the file: its tree of links, its joints and their numbers",
            path=str(path),
        ) from error
    for joint in range(1, model.njoints):
        if model.joints[joint].nq > 1:
            raise HandError(
                f"joint '{model.names[joint]}' of hand '{hand}' is not a plain joint with limits",
                remedy="make it revolute or prismatic with limits, or lock it with hand.locked_deg",
                joint=model.names[joint],
            )
    return model, geometry


def _palm_placement(model: pinocchio.Model, palm: PalmDescription, hand: str) -> pinocchio.SE3:
    if not model.existFrame(palm.link):
        known = ", ".join(f.name for f in model.frames if f.type == pinocchio.FrameType.BODY)
        raise HandError(f"hand '{hand}' has no palm link '{palm.link}'", remedy=f"choose one of {known}")
    frame = model.frames[model.getFrameId(palm.link)]
    rotation = pinocchio.rpy.rpyToMatrix(np.radians(palm.rpy_deg))
    return frame.placement * pinocchio.SE3(rotation, np.array(palm.xyz_m))


def _rest(model: pinocchio.Model, fingers: tuple[FingerDescription, ...]) -> FloatArray:
    """Return the joints of a hand no finger of which is used."""
    rest = np.clip(0.0, model.lowerPositionLimit, model.upperPositionLimit)
    for finger in fingers:
        angles = finger.rest_deg if finger.rest_deg is not None else finger.posture_deg
        if angles is None:
            continue
        frame = model.frames[model.getFrameId(finger.tip)]
        support = [j for j in model.supports[frame.parentJoint] if j != 0]
        if len(angles) != len(support):  # those of joints that follow others may be left out
            support = [j for j in support if model.joints[j].nq == 1]
        for joint, angle in zip(support, angles, strict=False):
            if model.joints[joint].nq == 0:
                continue
            i = model.joints[joint].idx_q
            slides = "P" in model.joints[joint].shortname().removeprefix("JointModel")
            value = float(joint_units(np.array(angle), np.array(int(slides))))
            rest[i] = np.clip(value, model.lowerPositionLimit[i], model.upperPositionLimit[i])
    return np.asarray(rest, dtype=float)
