"""Shapes of the collision library for the independent checks: distances, hulls, and shapes made thinner."""

import coal
import numpy as np
import pinocchio
import scipy.spatial

from graspbench.arrays import FloatArray

TOLERANCE_M = 1e-4
_GRAIN_M = 1e-6


def signed_distance(
    shape_a: coal.CollisionGeometry,
    pose_a: pinocchio.SE3,
    shape_b: coal.CollisionGeometry,
    pose_b: pinocchio.SE3,
) -> float:
    """Return the signed distance of two shapes: negative by the depth of their overlap."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    to_a = coal.Transform3s(pose_a.rotation, pose_a.translation)
    to_b = coal.Transform3s(pose_b.rotation, pose_b.translation)
    return float(coal.distance(shape_a, to_a, shape_b, to_b, request, result))


def eroded(shape: coal.CollisionGeometry) -> coal.CollisionGeometry:
    """Return the shape with its surface moved inwards by the tolerance; a mesh as it is."""
    e = TOLERANCE_M
    if isinstance(shape, coal.Sphere):
        return coal.Sphere(shape.radius - e)
    if isinstance(shape, coal.Capsule):
        return coal.Capsule(shape.radius - e, 2 * shape.halfLength)
    if isinstance(shape, coal.Cylinder):
        return coal.Cylinder(shape.radius - e, 2 * (shape.halfLength - e))
    if isinstance(shape, coal.Box):
        return coal.Box(*(2 * (np.asarray(shape.halfSide) - e)))
    return shape


def eroded_hull(shape: coal.CollisionGeometry) -> coal.CollisionGeometry:
    """Return what ``eroded`` does, of a mesh its convex hull with all planes moved inwards."""
    if not hasattr(shape, "vertices"):
        return eroded(shape)
    vertices = _vertices(shape)
    hull = scipy.spatial.ConvexHull(vertices)
    planes = hull.equations + np.array([0.0, 0.0, 0.0, TOLERANCE_M])
    inside = vertices[hull.vertices].mean(axis=0)
    if np.max(planes[:, :3] @ inside + planes[:, 3]) > -_GRAIN_M:
        return coal.Sphere(_GRAIN_M)
    return hull_of_points(scipy.spatial.HalfspaceIntersection(planes, inside).intersections)


def convex(shape: coal.CollisionGeometry) -> coal.CollisionGeometry:
    """Return a mesh's convex hull; other shapes as they are."""
    return hull_of_points(_vertices(shape)) if hasattr(shape, "vertices") else shape


def _vertices(shape: coal.CollisionGeometry) -> FloatArray:
    return np.array(shape.vertices(), dtype=float).reshape(-1, 3)


def hull_of_points(points: FloatArray) -> coal.Convex:
    """Return the convex hull of points, shape (n, 3), that span a solid."""
    vertices = coal.StdVec_Vec3s()
    for point in points:
        vertices.append(np.asarray(point, dtype=float))
    return coal.Convex.convexHull(vertices, True, "Qt")
