"""Distances from points to the surface of a mesh."""

import coal
import numpy as np
import trimesh

from graspbench.arrays import FloatArray


def distances_to_mesh(points: FloatArray, mesh: trimesh.Trimesh) -> FloatArray:
    """Return how far points are from a mesh's surface, inside and outside alike.

    Args:
        points: In the mesh's frame, shape (n, 3).
        mesh: Any triangle mesh.

    Returns:
        Distances, shape (n,), in the mesh's unit.
    """
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addVertices(np.asarray(mesh.vertices, dtype=np.float64))
    model.addTriangles(np.asarray(mesh.faces, dtype=np.int64))
    model.endModel()
    probe, request = coal.Sphere(0.0), coal.DistanceRequest()
    origin, distances = coal.Transform3s.Identity(), np.empty(len(points))
    pose = coal.Transform3s.Identity()
    for i, point in enumerate(points):
        pose.setTranslation(point)
        distances[i] = abs(coal.distance(model, origin, probe, pose, request, coal.DistanceResult()))
    return distances
