"""A hand's collision shapes as plain arrays, read from its URDF."""

from typing import NamedTuple

import coal
import numpy as np
import pinocchio

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import HandError
from graspbench.hand.gjk import BOX, CYLINDER, SEGMENT, core_distance

PALM = -1


class Shapes(NamedTuple):
    """Rounded boxes, segments and cylinders fixed to the palm (first) or to the links of the fingers.

    Attributes:
        finger: Finger that carries the shape, -1 for the palm, shape (s,).
        link: Position in the chain of the joint that moves it, -1 for the palm, shape (s,).
        kind: SEGMENT, BOX or CYLINDER, shape (s,).
        rotations: Orientation in the joint's frame (palm frame), shape (s, 3, 3).
        centres: Centre in the joint's frame (palm frame), shape (s, 3), m.
        halves: Half extents of the core, shape (s, 3), m.
        radii: Radius of the ball the core is swept by, shape (s,), m.
        bounds: Radius of the bounding sphere around the centre, shape (s,), m.
        is_tip: Whether it is the fingertip's sphere, shape (s,).
        pairs: Pairs of shapes that must not touch, shape (p, 2).
    """

    finger: IntArray
    link: IntArray
    kind: IntArray
    rotations: FloatArray
    centres: FloatArray
    halves: FloatArray
    radii: FloatArray
    bounds: FloatArray
    is_tip: IntArray
    pairs: IntArray


class _Shape(NamedTuple):
    finger: int
    link: int
    kind: int
    rotation: FloatArray
    centre: FloatArray
    half: FloatArray
    radius: float
    is_tip: int


def extract_shapes(
    model: pinocchio.Model,
    geometry: pinocchio.GeometryModel,
    data: pinocchio.Data,
    palm: pinocchio.SE3,
    frames: dict[int, tuple[int, int, pinocchio.SE3]],
    tips: FloatArray,
    counts: IntArray,
    tip_radius_m: float,
) -> Shapes:
    """Read the collision shapes of palm and fingers.

    Spheres, capsules, boxes and cylinders are taken as they are (a cylinder longer than thick as the
    capsule around it); anything else as its box in its own frame. Links moved by joints outside the
    fingers count as palm, in the posture of ``data``.

    Args:
        model: The hand.
        geometry: Its collision geometry.
        data: Joint placements for the idle joints, by ``pinocchio.forwardKinematics``.
        palm: Pose of the palm frame in the model's base.
        frames: Fingers' joints, from ``extract_chains``.
        tips: Tip centres in the last joint frames, shape (f, 3), m.
        counts: Number of joints of each finger, shape (f,).
        tip_radius_m: Radius of the fingertips.
    """
    shapes: list[_Shape] = []
    for item in geometry.geometryObjects:
        kind, half, radius, offset = _core(item.geometry)
        placement = item.placement * offset
        finger, link = PALM, PALM
        if item.parentJoint in frames:
            finger, link, turn = frames[item.parentJoint]
            placement = turn * placement
        else:
            placement = palm.inverse() * data.oMi[item.parentJoint] * placement
        at_tip = finger != PALM and link == counts[finger] - 1 and kind == SEGMENT and half[2] == 0.0
        at_tip = at_tip and bool(np.linalg.norm(placement.translation - tips[finger]) < 1e-6)
        shapes.append(
            _Shape(finger, link, kind, placement.rotation, placement.translation, half, radius, int(at_tip))
        )
    for f, tip in enumerate(tips):
        if not any(s.is_tip and s.finger == f and s.radius >= tip_radius_m - 1e-9 for s in shapes):
            shapes.append(
                _Shape(f, int(counts[f]) - 1, SEGMENT, np.eye(3), tip, np.zeros(3), tip_radius_m, 1)
            )
    shapes = _without_covered(shapes)
    shapes.sort(key=lambda s: (s.finger, s.link))
    half_extents = np.array([s.half for s in shapes])
    radii = np.array([s.radius for s in shapes])
    reach = np.array(
        [np.hypot(s.half[0], s.half[2]) if s.kind == CYLINDER else np.linalg.norm(s.half) for s in shapes]
    )
    return Shapes(
        finger=np.array([s.finger for s in shapes], dtype=np.int64),
        link=np.array([s.link for s in shapes], dtype=np.int64),
        kind=np.array([s.kind for s in shapes], dtype=np.int64),
        rotations=np.ascontiguousarray([s.rotation for s in shapes]),
        centres=np.ascontiguousarray([s.centre for s in shapes]),
        halves=half_extents,
        radii=radii,
        bounds=reach + radii,
        is_tip=np.array([s.is_tip for s in shapes], dtype=np.int64),
        pairs=np.zeros((0, 2), dtype=np.int64),
    )


def with_pairs(shapes: Shapes, rotations: FloatArray, centres: FloatArray) -> Shapes:
    """Choose the pairs to check for collisions.

    Not checked are shapes of the same link, of links joined to each other, and links of one finger (or
    of a finger and the palm) that overlap in the preferred posture already: these belong together.

    Args:
        shapes: The shapes.
        rotations: Their orientations in the preferred posture, palm frame, shape (s, 3, 3).
        centres: Their centres in the preferred posture, palm frame, shape (s, 3).
    """
    point_a, point_b = np.empty(3), np.empty(3)
    bodies = list(zip(shapes.finger.tolist(), shapes.link.tolist(), strict=True))
    candidates, overlapping = [], set()
    for b in range(len(bodies)):
        for a in range(b):
            (finger_a, link_a), (finger_b, link_b) = bodies[a], bodies[b]
            related = finger_a == finger_b or PALM in (finger_a, finger_b)
            if related and abs(link_b - link_a) <= 1:
                continue
            candidates.append((a, b))
            distance = core_distance(
                shapes.kind[a], rotations[a], centres[a], shapes.halves[a],
                shapes.kind[b], rotations[b], centres[b], shapes.halves[b],
                point_a, point_b,
            ) - (shapes.radii[a] + shapes.radii[b])  # fmt: skip
            if related and distance < 0.0:
                overlapping.add((bodies[a], bodies[b]))
    kept = [(a, b) for a, b in candidates if (bodies[a], bodies[b]) not in overlapping]
    return shapes._replace(pairs=np.array(kept, dtype=np.int64).reshape(-1, 2))


def _core(geometry: coal.CollisionGeometry) -> tuple[int, FloatArray, float, pinocchio.SE3]:
    """Return kind, half extents, radius and placement of a Coal shape."""
    here = pinocchio.SE3.Identity()
    if isinstance(geometry, coal.Sphere):
        return SEGMENT, np.zeros(3), float(geometry.radius), here
    if isinstance(geometry, coal.Capsule):
        return SEGMENT, np.array([0.0, 0.0, geometry.halfLength]), float(geometry.radius), here
    if isinstance(geometry, coal.Cylinder):
        radius, half = float(geometry.radius), float(geometry.halfLength)
        if half > radius:
            return SEGMENT, np.array([0.0, 0.0, half]), radius, here
        return CYLINDER, np.array([radius, radius, half]), 0.0, here
    if isinstance(geometry, coal.Box):
        return BOX, np.array(geometry.halfSide, dtype=float), 0.0, here
    geometry.computeLocalAABB()
    box = geometry.aabb_local
    low, high = np.array(box.min_, dtype=float), np.array(box.max_, dtype=float)
    if not np.all(np.isfinite(low) & np.isfinite(high)):
        raise HandError(
            f"a collision shape of type {type(geometry).__name__} has no bounds",
            remedy="use spheres, boxes, cylinders or meshes in the URDF",
        )
    return BOX, (high - low) / 2, 0.0, pinocchio.SE3(np.eye(3), (low + high) / 2)


def _without_covered(shapes: list[_Shape]) -> list[_Shape]:
    """Drop spheres that lie inside a capsule or sphere of the same link."""
    kept = []
    for i, ball in enumerate(shapes):
        covered = False
        if ball.kind == SEGMENT and ball.half[2] == 0.0 and not ball.is_tip:
            for j, other in enumerate(shapes):
                same = (other.finger, other.link, other.kind) == (ball.finger, ball.link, SEGMENT)
                if i == j or not same or (other.half[2] == 0.0 and not other.is_tip and j > i):
                    continue
                axis = other.rotation[:, 2]
                along = np.clip(axis @ (ball.centre - other.centre), -other.half[2], other.half[2])
                gap = np.linalg.norm(ball.centre - other.centre - along * axis)
                covered |= bool(gap + ball.radius <= other.radius + 1e-9)
        if not covered:
            kept.append(ball)
    return kept
