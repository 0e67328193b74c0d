"""An independent check of a posture: Pinocchio's kinematics and Coal's distances between full shapes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import coal
import numpy as np
import pinocchio

from graspbench.arrays import BoolArray, FloatArray
from graspbench.hand.coal_shapes import TOLERANCE_M as DEPTH_TOLERANCE_M
from graspbench.hand.coal_shapes import eroded, eroded_hull, signed_distance
from graspbench.hand.model import HandModel
from graspbench.hand.parameters import Margins
from graspbench.hand.posture import HandPosture
from graspbench.hand.shapes import FINGER, LINK, PALM
from graspbench.hand.touch_check import check_touch

if TYPE_CHECKING:
    import trimesh

TIP_TOLERANCE_M = 1e-4

Body = tuple[int, int]


def verify_posture(
    hand: HandModel,
    posture: HandPosture,
    points: FloatArray,
    normals: FloatArray,
    *,
    ground_height_m: float | None = 0.0,
    object_mesh: trimesh.Trimesh | None = None,
    margins: Margins | None = None,
) -> tuple[str, ...]:
    """Check a posture for a grasp; nothing of the search that found it is used.

    Tips must be within 0.1 mm of their places (of last links that touch, their surfaces of the contacts),
    joints inside their limits, singular values above their threshold, and nothing may overlap by more than
    0.1 mm: links, palm, ground, object. Fingertips may touch the object.

    Args:
        hand: The hand.
        posture: The posture.
        points: Contact points in the world, shape (m, 3).
        normals: Outward unit normals, shape (m, 3).
        ground_height_m: Height of the ground; None for none.
        object_mesh: The object in the world.
        margins: For the singular value's threshold; the hand's own by default.

    Returns:
        What is violated, one clause each; empty when all is well.
    """
    margins = hand.margins if margins is None else margins
    model, data = hand.model, hand.model.createData()
    pinocchio.computeJointJacobians(model, data, posture.joints)
    pinocchio.updateFramePlacements(model, data)
    root = pinocchio.SE3(posture.transform_palm_to_world @ np.linalg.inv(hand.transform_palm_to_root))
    found = _check_joints(hand, posture)
    placements = [
        root * data.oMi[item.parentJoint] * item.placement for item in hand.geometry.geometryObjects
    ]
    for contact, finger in enumerate(posture.fingers):
        frame = model.getFrameId(hand.tip_links[finger])
        tip = root.act(data.oMf[frame].translation)
        name = hand.finger_names[finger]
        jacobian = pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED)
        jacobian = jacobian.reshape(6, -1)  # of one joint it is a vector
        if hand.tips_are_links:
            own = hand.chain_joints[finger][-1]
            found += check_touch(hand, own, placements, points[contact], normals[contact], name)
            arm = root.rotation.T @ (points[contact] - tip)
            jacobian = jacobian[:3] - pinocchio.skew(arm) @ jacobian[3:]
        else:
            error = np.linalg.norm(tip - points[contact] - hand.tip_radius_m * normals[contact])
            if error > TIP_TOLERANCE_M:
                found.append(f"the tip of finger '{name}' is {error * 1e3:.2f} mm from its place")
            jacobian = jacobian[:3]
        # Of a finger that moves its tip in a plane or along a line only: the smallest of these directions.
        values = np.linalg.svd(jacobian[:, hand.finger_joints(finger)], compute_uv=False)
        singular = values[hand.freedom[finger] - 1]
        if singular < margins.singular_value_m:
            found.append(f"finger '{name}' is near a singularity ({singular * 1e3:.1f} mm/rad)")
    found += _check_hand(hand, placements)
    if ground_height_m is not None:
        found += _check_ground(hand, placements, ground_height_m)
    if object_mesh is not None:
        found += _check_object(hand, placements, object_mesh)
    return tuple(found)


def _check_joints(hand: HandModel, posture: HandPosture) -> list[str]:
    outside = (posture.joints < hand.lower) | (posture.joints > hand.upper)
    return [f"joint '{hand.joint_names[i]}' is outside its limits" for i in np.flatnonzero(outside)]


def overlaps(hand: HandModel, joints: FloatArray, fingers: tuple[int, ...] | None = None) -> tuple[str, ...]:
    """Say which links of a hand overlap in a posture, one clause each.

    Args:
        hand: The hand.
        joints: Shape (n_q,).
        fingers: Only overlaps of these fingers with each other and with the palm; None for all.
    """
    data = hand.model.createData()
    pinocchio.forwardKinematics(hand.model, data, joints)
    placements = [data.oMi[item.parentJoint] * item.placement for item in hand.geometry.geometryObjects]
    return tuple(_check_hand(hand, placements, fingers))


def _check_hand(
    hand: HandModel, placements: list[pinocchio.SE3], fingers: tuple[int, ...] | None = None
) -> list[str]:
    index = [(int(row[FINGER]), int(row[LINK])) for row in hand.shapes.index]
    checked = {frozenset((index[a], index[b])) for a, b in hand.shapes.pairs}
    items = hand.geometry.geometryObjects
    bodies = link_of_shapes(hand)
    near = _bounds_meet(items, placements)
    found = []
    for b in range(len(items)):
        for a in range(b):
            if not near[a, b] or frozenset((bodies[a], bodies[b])) not in checked:
                continue
            if fingers is not None and not {bodies[a][0], bodies[b][0]} <= {PALM, *fingers}:
                continue
            distance = signed_distance(items[a].geometry, placements[a], items[b].geometry, placements[b])
            if distance < -DEPTH_TOLERANCE_M:
                found.append(f"{items[a].name} and {items[b].name} overlap by {-distance * 1e3:.2f} mm")
    return found


def _bounds_meet(items: Sequence[pinocchio.GeometryObject], placements: list[pinocchio.SE3]) -> BoolArray:
    """Tell of which shapes the spheres around their bounding boxes meet, shape (n, n)."""
    centres, radii = np.zeros((len(items), 3)), np.zeros(len(items))
    for i, (item, placement) in enumerate(zip(items, placements, strict=True)):
        item.geometry.computeLocalAABB()
        centres[i], radii[i] = placement.act(item.geometry.aabb_center), item.geometry.aabb_radius
    apart = np.linalg.norm(centres[:, None] - centres, axis=2)
    return np.asarray(apart <= radii[:, None] + radii)


def link_of_shapes(hand: HandModel) -> list[Body]:
    """Return the finger and link that carries each geometry object; the palm for all else."""
    at = {joint: (f, k) for f, chain in enumerate(hand.chain_joints) for k, joint in enumerate(chain)}
    return [at.get(item.parentJoint, (PALM, PALM)) for item in hand.geometry.geometryObjects]


def _check_ground(hand: HandModel, placements: list[pinocchio.SE3], height: float) -> list[str]:
    below = coal.Halfspace(np.array([0.0, 0.0, 1.0]), height)
    found = []
    for item, placement in zip(hand.geometry.geometryObjects, placements, strict=True):
        depth = -signed_distance(item.geometry, placement, below, pinocchio.SE3.Identity())
        if depth > DEPTH_TOLERANCE_M:
            found.append(f"{item.name} is {depth * 1e3:.2f} mm in the ground")
    return found


def _check_object(hand: HandModel, placements: list[pinocchio.SE3], mesh: trimesh.Trimesh) -> list[str]:
    body = coal.BVHModelOBBRSS()
    body.beginModel(len(mesh.faces), len(mesh.vertices))
    body.addVertices(np.asarray(mesh.vertices))
    body.addTriangles(np.asarray(mesh.faces, dtype=np.uint32))
    body.endModel()
    found = []
    last = {joints[-1] for joints in hand.chain_joints}
    for item, placement in zip(hand.geometry.geometryObjects, placements, strict=True):
        # Against a mesh Coal tells whether shapes overlap, but not how deep: hence the thinner shape.
        touches = hand.tips_are_links and item.parentJoint in last
        shape = (eroded_hull if touches else eroded)(item.geometry)
        at = coal.Transform3s(placement.rotation, placement.translation)
        request, result = coal.CollisionRequest(), coal.CollisionResult()
        hit = coal.collide(shape, at, body, coal.Transform3s.Identity(), request, result) > 0
        if hit or _inside(mesh, placement.translation):
            found.append(f"{item.name} is more than {DEPTH_TOLERANCE_M * 1e3:g} mm in the object")
    return found


def _inside(mesh: trimesh.Trimesh, point: FloatArray) -> bool:
    """Tell by the winding number whether a closed mesh contains a point (van Oosterom and Strackee 1983)."""
    if np.any(point < mesh.bounds[0]) or np.any(point > mesh.bounds[1]):
        return False
    a, b, c = np.moveaxis(np.asarray(mesh.triangles) - point, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    top = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
    bottom = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    return bool(np.arctan2(top, bottom).sum() > np.pi)
