"""Integrals and normals of a closed triangulated surface."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.reconstruction.network import SurfaceNetwork


def enclosed_solid(points: FloatArray, network: SurfaceNetwork) -> tuple[float, FloatArray]:
    """Return the volume (m3) and the centre of mass, shape (3,), of the solid inside a surface."""
    centroid = np.empty(3)
    volume = _volume_and_centroid(points, network.faces, centroid)
    return volume, centroid


def vertex_normals(points: FloatArray, network: SurfaceNetwork, *, smoothing: int = 0) -> FloatArray:
    """Return outward unit normals at the nodes, shape (n_s, 3).

    Each face counts with its area over the squared lengths of the two edges that meet in the node,
    which is exact on spheres however the nodes lie (Max, "Weights for computing vertex normals from
    facet normals", 1999); at a pole all meridians' faces count.

    Args:
        points: Node positions, shape (n_s, 3).
        network: How the nodes are linked.
        smoothing: Passes that average each normal with those of its contour.
    """
    normals = np.zeros_like(points)
    _face_sums(points, network.faces, normals)
    if smoothing:
        other = np.empty_like(points)
        for _ in range(smoothing):
            _average(points, normals, network.contour_start, network.contour_nodes, other)
            normals, other = other, normals
    return normals


@compiled
def _volume_and_centroid(points: FloatArray, faces: IntArray, centroid: FloatArray) -> float:
    origin = points[0]
    volume = 0.0
    centroid[:] = 0.0
    for f in range(len(faces)):
        a = points[faces[f, 0]]
        b = points[faces[f, 1]]
        c = points[faces[f, 2]]
        ax, ay, az = a[0] - origin[0], a[1] - origin[1], a[2] - origin[2]
        bx, by, bz = b[0] - origin[0], b[1] - origin[1], b[2] - origin[2]
        cx, cy, cz = c[0] - origin[0], c[1] - origin[1], c[2] - origin[2]
        six = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        volume += six
        centroid[0] += six * (ax + bx + cx)
        centroid[1] += six * (ay + by + cy)
        centroid[2] += six * (az + bz + cz)
    for k in range(3):
        centroid[k] = origin[k] + centroid[k] / (4.0 * volume)
    return volume / 6.0


@compiled
def _face_sums(points: FloatArray, faces: IntArray, normals: FloatArray) -> None:
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        a, b, c = points[i], points[j], points[k]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        wx, wy, wz = c[0] - b[0], c[1] - b[1], c[2] - b[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        uu = max(ux * ux + uy * uy + uz * uz, 1e-30)
        vv = max(vx * vx + vy * vy + vz * vz, 1e-30)
        ww = max(wx * wx + wy * wy + wz * wz, 1e-30)
        for node, weight in ((i, 1.0 / (uu * vv)), (j, 1.0 / (uu * ww)), (k, 1.0 / (vv * ww))):
            normals[node, 0] += weight * nx
            normals[node, 1] += weight * ny
            normals[node, 2] += weight * nz
    for a in range(len(points)):
        _normalise(normals, a)


@compiled
def _average(
    points: FloatArray, normals: FloatArray, start: IntArray, contour: IntArray, averaged: FloatArray
) -> None:
    for a in range(len(points)):
        nearest = 1e30
        for k in range(start[a], start[a + 1]):
            b = contour[k]
            square = (
                (points[a, 0] - points[b, 0]) ** 2
                + (points[a, 1] - points[b, 1]) ** 2
                + (points[a, 2] - points[b, 2]) ** 2
            )
            nearest = min(nearest, square)
        for k in range(3):
            averaged[a, k] = normals[a, k]
        for k in range(start[a], start[a + 1]):
            b = contour[k]
            square = (
                (points[a, 0] - points[b, 0]) ** 2
                + (points[a, 1] - points[b, 1]) ** 2
                + (points[a, 2] - points[b, 2]) ** 2
            )
            # Far neighbours say little about the surface here; the nearest counts half as much as the node.
            weight = 0.5 * (nearest + 1e-30) / (square + 1e-30)
            averaged[a, 0] += weight * normals[b, 0]
            averaged[a, 1] += weight * normals[b, 1]
            averaged[a, 2] += weight * normals[b, 2]
        _normalise(averaged, a)


@inner
def _normalise(vectors: FloatArray, a: int) -> None:
    x, y, z = vectors[a, 0], vectors[a, 1], vectors[a, 2]
    length = np.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        vectors[a, 0] = x / length
        vectors[a, 1] = y / length
        vectors[a, 2] = z / length
    else:
        vectors[a, 2] = 1.0
