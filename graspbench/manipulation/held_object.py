"""An object in the hand, ready to be moved: the system of hand, contacts and object at its start."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import HandError, ManipulationError
from graspbench.grasp.configuration import Grasp
from graspbench.hand import HandModel
from graspbench.manipulation.charts import Chart, mesh_patch
from graspbench.manipulation.contact_kinematics import Contact, ContactType, ManipulationSystem
from graspbench.manipulation.kinematic_tree import KinematicTree, tree_from_pinocchio
from graspbench.reconstruction.surface import Surface


@dataclass(frozen=True, eq=False)
class HeldObject:
    """The start of an in-hand motion.

    Attributes:
        system: Hand, contacts and object.
        joints: Shape (n_q,), rad.
        variables: [xi; theta] of the contacts, shape (n_c, 5).
        position: The object's origin in the palm frame, shape (3,), m.
        rotation: Its orientation there, shape (3, 3).
        transform_palm_to_world: Pose of the palm, shape (4, 4).
        joint_names: Of the hand.
    """

    system: ManipulationSystem
    joints: FloatArray
    variables: FloatArray
    position: FloatArray
    rotation: FloatArray
    transform_palm_to_world: FloatArray
    joint_names: tuple[str, ...]


def hold_object(
    hand: HandModel,
    grasp: Grasp,
    surface: Surface | Chart | Sequence[Chart],
    kind: ContactType,
    *,
    sliding: Sequence[int] = (),
    led: bool = False,
    patch_radius_m: float = 0.015,
    transform_object_to_world: FloatArray | None = None,
) -> HeldObject:
    """Return the object as a grasp holds it.

    Args:
        hand: The hand.
        grasp: Grasp with the hand's posture, its contacts in the world.
        surface: The object's reconstructed surface in the world, from which a chart is fitted around
            each contact; or one chart for all contacts, or one a contact, in the object frame.
        kind: Type of the contacts.
        sliding: Contacts that slide over the object with the friction of this type.
        led: Whether these do so on a given way.
        patch_radius_m: Size of the fitted charts.
        transform_object_to_world: The object's pose; by default its frame is at the grasp's centroid with the
            world's axes.

    Raises:
        HandError: The grasp has no posture.
        ManipulationError: A fingertip cannot be brought onto its contact.
    """
    refuse_links(hand)
    posture = grasp.posture
    if posture is None:
        raise HandError("the grasp has no hand posture", remedy="plan it with a hand")
    pose = np.eye(4) if transform_object_to_world is None else np.array(transform_object_to_world)
    if transform_object_to_world is None:
        pose[:3, 3] = grasp.centroid
    charts = _charts(surface, grasp, pose, patch_radius_m)
    contacts = [
        Contact(chart, kind, hand.tip_radius_m, i in sliding, led and i in sliding)
        for i, chart in enumerate(charts)
    ]
    to_palm = np.linalg.inv(posture.transform_palm_to_world) @ pose
    rough = ManipulationSystem(hand_tree(hand, posture.fingers), contacts)
    touching = _contact_coordinates(charts, grasp, pose)
    joints = touch(rough, posture.joints, touching, to_palm)
    position, rotation = to_palm[:3, 3], to_palm[:3, :3]
    system, variables = rough.grasped(joints, position, rotation, coordinates=touching)
    palm = posture.transform_palm_to_world
    return HeldObject(system, joints, variables, position, rotation, palm, hand.joint_names)


def refuse_links(hand: HandModel) -> None:
    """Refuse a hand that touches with its links: what rolls here are spheres.

    Raises:
        ManipulationError: It does.
    """
    if hand.tips_are_links:
        raise ManipulationError(
            f"objects are moved in the hand by spherical tips that roll on them; hand '{hand.name}' touches "
            "with its links",
            remedy="set hand.tip_shape=sphere",
        )


def hand_tree(hand: HandModel, fingers: Sequence[int]) -> KinematicTree:
    """Return the tree of a hand in its palm frame, with one tip for each of the chosen fingers."""
    tree = tree_from_pinocchio(hand.model, [hand.tip_links[finger] for finger in fingers])
    to_palm = np.linalg.inv(hand.transform_palm_to_root)
    rotations, translations = tree.placement_rotations.copy(), tree.placement_translations.copy()
    for joint in np.flatnonzero(tree.parents < 0):
        rotations[joint] = to_palm[:3, :3] @ rotations[joint]
        translations[joint] = to_palm[:3, :3] @ translations[joint] + to_palm[:3, 3]
    return replace(
        tree,
        placement_rotations=rotations,
        placement_translations=translations,
        lower=hand.lower,
        upper=hand.upper,
        velocity_limits=hand.velocity_limits,
    )


def _charts(
    surface: Surface | Chart | Sequence[Chart], grasp: Grasp, pose: FloatArray, radius_m: float
) -> list[Chart]:
    n = len(grasp.points)
    if isinstance(surface, Chart):
        return [surface] * n
    if not isinstance(surface, Surface):
        return list(surface)
    inverse = np.linalg.inv(pose)
    points = surface.points @ inverse[:3, :3].T + inverse[:3, 3]
    centres = grasp.points @ inverse[:3, :3].T + inverse[:3, 3]
    normals = grasp.normals @ inverse[:3, :3].T
    return [
        mesh_patch(points, centre, normal, radius_m=radius_m)
        for centre, normal in zip(centres, normals, strict=True)
    ]


def _contact_coordinates(charts: Sequence[Chart], grasp: Grasp, pose: FloatArray) -> FloatArray:
    """Return where on its chart each contact of the grasp lies, shape (n_c, 2)."""
    points = (grasp.points - pose[:3, 3]) @ pose[:3, :3]
    return np.array([chart.locate(point) for chart, point in zip(charts, points, strict=True)])


def touch(
    system: ManipulationSystem, joints: FloatArray, coordinates: FloatArray, to_palm: FloatArray
) -> FloatArray:
    """Return joints that bring each tip's centre exactly to radius from its contact, shape (n_q,).

    It closes the gap a planned posture leaves: that was planned for the normals of a mesh; those of the
    smooth charts are a little different. The contacts stay where they were planned: a tip's nearest point
    would jump where the surface bends more than the tip.

    Args:
        system: Hand and contacts.
        joints: Where to begin, shape (n_q,).
        coordinates: The contacts on their charts, shape (n_c, 2).
        to_palm: Pose of the object, transform_object_to_palm, shape (4, 4).

    Raises:
        ManipulationError: A tip cannot be brought there.
    """
    q = np.array(joints, dtype=np.float64)
    state = system.state(q, np.zeros((system.n_contacts, 5)))
    targets = np.empty((system.n_contacts, 3))
    for i, contact in enumerate(system.contacts):
        at = contact.chart(coordinates[i])
        targets[i] = to_palm[:3, :3] @ (at.point + contact.tip_radius_m * at.frame[:, 2]) + to_palm[:3, 3]
    for _ in range(40):
        misses = targets - state.tip_positions
        if np.abs(misses).max() < 1e-12:
            return q
        stacked = state.tip_jacobians[:, :3].reshape(-1, system.n_joints)
        change = np.linalg.pinv(stacked, rcond=1e-3) @ misses.ravel()
        q = np.clip(q + change, system.tree.lower, system.tree.upper)
        state.update(q, state.contact_variables)
    gap = float(np.linalg.norm(targets - state.tip_positions, axis=1).max())
    if gap > 1e-7:
        raise ManipulationError(
            f"a fingertip stays {gap * 1e3:.3f} mm off the surface at the start",
            remedy="plan the grasp with a larger hand.margins.joint",
            gap_m=gap,
        )
    return q
