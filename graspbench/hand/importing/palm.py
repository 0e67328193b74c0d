"""The palm of a hand that is being read: its shapes, and the frame that the planners place."""

import coal
import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.hand.importing.surfaces import surface_points
from graspbench.hand.model import HandModel

_FAR_M, _NEAR_M = 0.3, 1e-3


def palm_frame(
    hand: HandModel, centre: FloatArray, tips: FloatArray, approach: FloatArray | None
) -> FloatArray:
    """Return the palm frame: z across the opposing tips, away from the palm; its origin on the palm."""
    cloud = palm_cloud(hand)
    bases = np.array([hand.chains.fixed[f, 0, :, 3] for f in range(hand.n_fingers)])
    towards = centre - (
        bases.mean(axis=0) if not len(cloud) else 0.5 * (bases.mean(axis=0) + cloud.mean(axis=0))
    )
    if len(tips) == 2:
        line = (tips[1] - tips[0]) / np.linalg.norm(tips[1] - tips[0])
        z = towards - (towards @ line) * line
    else:
        z = np.linalg.svd(tips - tips.mean(axis=0))[2][-1]
        z = z if z @ towards >= 0.0 else -z
        # Where the tips' plane stands across the palm, the way from the palm decides.
        if z @ towards < 0.3 * np.linalg.norm(towards):
            z = z + towards / max(float(np.linalg.norm(towards)), 1e-9)
    if approach is not None:
        z = approach
    z = z / max(float(np.linalg.norm(z)), 1e-9)
    along = cloud - centre if len(cloud) else bases - centre
    beside = np.linalg.norm(along - np.outer(along @ z, z), axis=1)
    near = along[beside <= max(0.03, float(beside.min()) + 1e-6)] @ z
    front = float(near[near < 0.0].max()) if np.any(near < 0.0) else float(near.min())
    front = -_travel(hand, centre, -z, -front)
    x = bases.mean(axis=0) - centre
    x = x - (x @ z) * z
    if np.linalg.norm(x) < 5e-3:
        x = np.eye(3)[int(np.argmin(np.abs(z)))]
        x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack((x, np.cross(z, x), z))
    frame[:3, 3] = centre + front * z
    return frame


def _travel(hand: HandModel, start: FloatArray, direction: FloatArray, otherwise: float) -> float:
    """Return how far it is from a point along a direction to the palm's shapes, or ``otherwise``."""
    palm, way = palm_shapes(hand), 0.0
    while palm and way < _FAR_M:
        gap = palm_distance(hand, palm, start + way * direction)
        if gap < _NEAR_M:
            return way
        way += gap
    return otherwise


def palm_cloud(hand: HandModel) -> FloatArray:
    """Return points on the palm's shapes in the palm frame, shape (n, 3), m; none where it has no shape."""
    root = pinocchio.SE3(hand.transform_palm_to_root).inverse()
    clouds = []
    for item in hand.geometry.geometryObjects:
        if item.parentJoint == 0:
            pose = root * item.placement
            clouds.append(surface_points(item.geometry) @ pose.rotation.T + pose.translation)
    return np.concatenate(clouds) if clouds else np.zeros((0, 3))


def palm_shapes(hand: HandModel) -> list[tuple[coal.CollisionGeometry, coal.Transform3s]]:
    """Return the palm's collision shapes with their poses in the hand's root frame."""
    return [
        (item.geometry, coal.Transform3s(item.placement.rotation, item.placement.translation))
        for item in hand.geometry.geometryObjects
        if item.parentJoint == 0
    ]


def palm_distance(
    hand: HandModel, palm: list[tuple[coal.CollisionGeometry, coal.Transform3s]], point: FloatArray
) -> float:
    """Return the distance of a point in the palm frame from the palm's shapes, m; large where it has none."""
    ball, least = coal.Sphere(1e-4), 1.0
    root = hand.transform_palm_to_root
    here = coal.Transform3s(np.eye(3), root[:3, :3] @ point + root[:3, 3])
    for shape, at in palm:
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        least = min(least, float(coal.distance(shape, at, ball, here, request, result)))
    return least
