"""A hand's collision geometry as solids to draw."""

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray, IntArray
from graspbench.report import style
from graspbench.report.solids import Solid, ball, mesh_solid, tube

if TYPE_CHECKING:
    from graspbench.hand.model import HandModel

_BOX_FACES = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
     [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
)  # fmt: skip


def hand_solids(
    hand: "HandModel", joints: FloatArray, transform_palm_to_world: FloatArray
) -> tuple[Solid, ...]:
    """Return the hand's links in the world.

    Args:
        hand: The hand.
        joints: Joint positions, shape (n_q,).
        transform_palm_to_world: Pose of the palm, shape (4, 4).
    """
    placed = placed_solids(hand, joints, transform_palm_to_world)
    return tuple(_moved(solid, pose) for solid, pose in placed)


def placed_solids(
    hand: "HandModel", joints: FloatArray, transform_palm_to_world: FloatArray
) -> list[tuple[Solid, FloatArray]]:
    """Return the hand's links in their own frames, each with its pose in the world, shape (4, 4)."""
    data, placed = hand.model.createData(), hand.geometry.createData()
    pinocchio.updateGeometryPlacements(hand.model, data, hand.geometry, placed, joints)
    root = transform_palm_to_world @ np.linalg.inv(hand.transform_palm_to_root)
    solids = []
    for item, placement in zip(hand.geometry.geometryObjects, placed.oMg, strict=True):
        solid = _solid(item.geometry, np.eye(4))
        if solid is not None:
            solids.append((solid, root @ placement.homogeneous))
    return solids


def _moved(solid: Solid, pose: FloatArray) -> Solid:
    rotation = pose[:3, :3]
    return dataclasses.replace(
        solid, points=solid.points @ rotation.T + pose[:3, 3], normals=solid.normals @ rotation.T
    )


def _solid(shape: Any, pose: FloatArray) -> Solid | None:
    """Return one shape of the collision library as a solid; None for what cannot be drawn."""
    if hasattr(shape, "halfSide"):
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
        return _mesh(corners * np.asarray(shape.halfSide).ravel(), _BOX_FACES, pose)
    if hasattr(shape, "halfLength"):
        axis = np.outer([-1.0, 1.0], pose[:3, 2]) * shape.halfLength
        if shape.radius > 1.5 * shape.halfLength:  # a disc, such as a palm
            return _disc(shape.radius, shape.halfLength, pose)
        return tube(pose[:3, 3] + axis, shape.radius, style.HAND, sides=24)
    if hasattr(shape, "radius") and np.ndim(shape.radius) == 0:
        return ball(pose[:3, 3], shape.radius, style.HAND)
    if hasattr(shape, "vertices") and hasattr(shape, "tri_indices"):
        faces = np.array([(t[0], t[1], t[2]) for t in map(shape.tri_indices, range(shape.num_tris))])
        return _mesh(np.asarray(shape.vertices()), faces, pose)  # scaled as it was read
    return None


def _disc(radius: float, half_height: float, pose: FloatArray, sides: int = 48) -> Solid:
    angles = 2 * np.pi * np.arange(sides) / sides
    ring = radius * np.column_stack((np.cos(angles), np.sin(angles), np.zeros(sides)))
    up = np.array([0.0, 0.0, half_height])
    points = np.vstack((ring - up, ring + up, [-up, up]))
    k = np.arange(sides)
    after = (k + 1) % sides
    side = [np.column_stack((k, after, after + sides)), np.column_stack((k, after + sides, k + sides))]
    caps = [
        np.column_stack((after, k, np.full(sides, 2 * sides))),
        np.column_stack((k + sides, after + sides, np.full(sides, 2 * sides + 1))),
    ]
    return _mesh(points, np.concatenate(side + caps), pose)


def _mesh(points: FloatArray, faces: IntArray, pose: FloatArray) -> Solid:
    return mesh_solid(points @ pose[:3, :3].T + pose[:3, 3], faces, style.HAND)
