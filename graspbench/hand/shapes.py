"""A hand's collision shapes as plain arrays, read from its URDF."""

from collections.abc import Sequence
from typing import NamedTuple

import coal
import numpy as np
import pinocchio

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.errors import HandError
from graspbench.hand.distance import BOX, CYLINDER, SEGMENT, core_distance
from graspbench.hand.hulls import Hull, stacked
from graspbench.hand.wrapping import Wrap, wrap_mesh

PALM = -1
_TIP_M = 1e-6

FINGER, LINK, KIND, IS_TIP = 0, 1, 2, 3
RADIUS, BOUND = 3, 4
CORNERS, PLANES = 0, 2


class Shapes(NamedTuple):
    """Rounded boxes, segments and cylinders fixed to the palm (first) or to the links of the fingers.

    Meshes are wrapped in one for distances within the hand, which are between two moving bodies; towards
    ground and object it is their convex hull that counts, which is closer to a fingertip.

    Attributes:
        index: Finger that carries the shape (-1: palm), position of the joint that moves it in the finger's
            chain (-1: palm), kind of its core, whether it is the fingertip's sphere; shape (s, 4).
        local: Pose of the core in the joint's frame (palm frame), shape (s, 3, 4).
        size: Half extents of the core, radius of the ball it is swept by, radius of the bounding sphere
            around its centre; shape (s, 5), m.
        pairs: Pairs of shapes that must not touch, shape (p, 2).
        corners: Corners of the meshes' hulls in their shapes' frames, shape (v, 3), m.
        planes: Their planes, outward unit normals and offsets, shape (q, 4), m.
        spans: First corner of each shape and the one after its last, the same of planes; both alike for a
            shape without a hull; shape (s, 4).
    """

    index: IntArray  # type: ignore[assignment]  # hides tuple.index, which nobody needs
    local: FloatArray
    size: FloatArray
    pairs: IntArray
    corners: FloatArray
    planes: FloatArray
    spans: IntArray


class _Shape(NamedTuple):
    finger: int
    link: int
    kind: int
    rotation: FloatArray
    centre: FloatArray
    half: FloatArray
    radius: float
    is_tip: int
    hull: Hull | None


def extract_shapes(
    model: pinocchio.Model,
    geometry: pinocchio.GeometryModel,
    data: pinocchio.Data,
    palm: pinocchio.SE3,
    frames: dict[int, tuple[int, int, pinocchio.SE3]],
    tips: FloatArray,
    counts: IntArray,
    *,
    tips_are_links: bool = False,
) -> Shapes:
    """Read the collision shapes of palm and fingers.

    Spheres, capsules, boxes and cylinders are taken as they are (a cylinder longer than thick as the
    capsule around it); meshes as the least box or capsule around them. Links moved by joints outside the
    fingers count as palm, in the posture of ``data``.

    Args:
        model: The hand.
        geometry: Its collision geometry.
        data: Joint placements for the idle joints, by ``pinocchio.forwardKinematics``.
        palm: Pose of the palm frame in the model's base.
        frames: Fingers' joints, from ``extract_chains``.
        tips: Tip centres in the last joint frames, shape (f, 3), m.
        counts: Number of joints of each finger, shape (f,).
        tips_are_links: Whether last links touch as they are: no sphere counts as a tip, meshes of last
            links have fine hulls, and their cylinders stay cylinders.
    """
    shapes: list[_Shape] = []
    for item in geometry.geometryObjects:
        finger, link, turn = frames.get(item.parentJoint, (PALM, PALM, None))
        touches = tips_are_links and finger != PALM and link == counts[finger] - 1
        (kind, half, radius, offset), hull = _core(item.geometry, exact=touches)
        placement = item.placement * offset
        if turn is not None:
            placement = turn * placement
        else:
            placement = palm.inverse() * data.oMi[item.parentJoint] * placement
        at_tip = finger != PALM and link == counts[finger] - 1 and kind == SEGMENT and half[2] == 0.0
        at_tip = (
            at_tip
            and not tips_are_links
            and bool(np.linalg.norm(placement.translation - tips[finger]) < _TIP_M)
        )
        shapes.append(
            _Shape(
                finger, link, kind, placement.rotation, placement.translation, half, radius, int(at_tip), hull
            )
        )
    shapes = _without_covered(shapes)
    shapes.sort(key=lambda s: (s.finger, s.link))
    reach = [np.hypot(s.half[0], s.half[2]) if s.kind == CYLINDER else np.linalg.norm(s.half) for s in shapes]
    return Shapes(
        index=np.array([(s.finger, s.link, s.kind, s.is_tip) for s in shapes], dtype=np.int64),
        local=np.array([np.column_stack([s.rotation, s.centre]) for s in shapes]),
        size=np.array([(*s.half, s.radius, r + s.radius) for s, r in zip(shapes, reach, strict=True)]),
        pairs=np.zeros((0, 2), dtype=np.int64),
        **stacked([shape.hull for shape in shapes]),
    )


def bare_tips(
    geometry: pinocchio.GeometryModel,
    frames: dict[int, tuple[int, int, pinocchio.SE3]],
    tips: FloatArray,
    counts: IntArray,
    tip_radius_m: float,
) -> list[int]:
    """Return the fingers whose tips have no sphere of the stated radius, or a larger one, at their centres.

    Args:
        geometry: The hand's collision geometry.
        frames: Fingers' joints, from ``extract_chains``.
        tips: Tip centres in the last joint frames, shape (f, 3), m.
        counts: Number of joints of each finger, shape (f,).
        tip_radius_m: Radius of the fingertips.
    """
    covered = set()
    for item in geometry.geometryObjects:
        finger, link, turn = frames.get(item.parentJoint, (PALM, PALM, None))
        if finger == PALM or link != counts[finger] - 1 or not isinstance(item.geometry, coal.Sphere):
            continue
        centre = (turn * item.placement).translation
        if np.linalg.norm(centre - tips[finger]) < _TIP_M and item.geometry.radius >= tip_radius_m - 1e-9:
            covered.add(finger)
    return [f for f in range(len(tips)) if f not in covered]


def with_pairs(shapes: Shapes, poses: FloatArray, others: Sequence[FloatArray] = ()) -> Shapes:
    """Choose the pairs to check for collisions.

    Not checked are shapes of the same link, of links joined to each other, and links of one finger (or
    of a finger and the palm) that overlap in the preferred posture already, or in most of some others: these
    belong together.

    Args:
        shapes: The shapes.
        poses: Their poses in the preferred posture, palm frame, shape (s, 3, 4).
        others: Their poses in postures from all over the joints' ranges.
    """
    bodies = [(int(row[FINGER]), int(row[LINK])) for row in shapes.index]
    candidates, overlapping = [], set()
    placed = np.array([poses, *others])
    near = _bounds_meet(shapes, placed)
    for b in range(len(bodies)):
        for a in range(b):
            (finger_a, link_a), (finger_b, link_b) = bodies[a], bodies[b]
            related = finger_a == finger_b or PALM in (finger_a, finger_b)
            if related and abs(link_b - link_a) <= 1:
                continue
            candidates.append((a, b))
            radii = float(shapes.size[a, RADIUS] + shapes.size[b, RADIUS])
            if not related:
                continue
            preferred, *drawn = (
                close and _overlap(shapes, each, a, b, radii)
                for close, each in zip(near[:, a, b], placed, strict=True)
            )
            if preferred or 2 * sum(drawn) > len(others):
                overlapping.add((bodies[a], bodies[b]))
    kept = [(a, b) for a, b in candidates if (bodies[a], bodies[b]) not in overlapping]
    return shapes._replace(pairs=np.array(kept, dtype=np.int64).reshape(-1, 2))


def _bounds_meet(shapes: Shapes, placed: FloatArray) -> BoolArray:
    """Tell in which postures, poses (n, s, 3, 4), two bounding spheres meet, shape (n, s, s)."""
    centres, bounds = placed[..., 3], shapes.size[:, BOUND]
    apart = np.linalg.norm(centres[:, :, None] - centres[:, None], axis=-1)
    return np.asarray(apart <= bounds[:, None] + bounds + 2.0 * _TIP_M)


def _overlap(shapes: Shapes, poses: FloatArray, a: int, b: int, radii: float) -> bool:
    distance = core_distance(
        shapes.index[a, KIND],
        poses[a],
        shapes.size[a],
        shapes.index[b, KIND],
        poses[b],
        shapes.size[b],
        radii,
    )[0]
    # Cores without a rounding radius that overlap are at a distance of 0.
    return bool(distance < radii + _TIP_M)


def _core(geometry: coal.CollisionGeometry, *, exact: bool) -> tuple[Wrap, Hull | None]:
    """Return kind, half extents, radius and placement of a Coal shape, and the convex hull of a mesh."""
    here = pinocchio.SE3.Identity()
    if isinstance(geometry, coal.Sphere):
        return (SEGMENT, np.zeros(3), float(geometry.radius), here), None
    if isinstance(geometry, coal.Capsule):
        return (SEGMENT, np.array([0.0, 0.0, geometry.halfLength]), float(geometry.radius), here), None
    if isinstance(geometry, coal.Cylinder):
        radius, half = float(geometry.radius), float(geometry.halfLength)
        if half > radius and not exact:
            return (SEGMENT, np.array([0.0, 0.0, half]), radius, here), None
        return (CYLINDER, np.array([radius, radius, half]), 0.0, here), None
    if isinstance(geometry, coal.Box):
        return (BOX, np.array(geometry.halfSide, dtype=float), 0.0, here), None
    if hasattr(geometry, "vertices"):
        vertices = np.array(geometry.vertices(), dtype=float).reshape(-1, 3)
        if (
            len(vertices) >= 4
            and np.all(np.isfinite(vertices))
            and (wrapped := wrap_mesh(vertices, fine=exact))
        ):
            return wrapped
    geometry.computeLocalAABB()
    box = geometry.aabb_local
    low, high = np.array(box.min_, dtype=float), np.array(box.max_, dtype=float)
    if not np.all(np.isfinite(low) & np.isfinite(high)):
        raise HandError(
            f"a collision shape of type {type(geometry).__name__} has no bounds",
            remedy="use spheres, boxes, cylinders or meshes in the URDF",
        )
    return (BOX, (high - low) / 2, 0.0, pinocchio.SE3(np.eye(3), (low + high) / 2)), None


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
