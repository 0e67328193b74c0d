"""Polygons of mesh files, cut into triangles."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray


def triangulated(vertices: FloatArray, corners: IntArray, sizes: IntArray) -> IntArray:
    """Return the triangles of polygons, shape (m, 3), in the polygons' orientation.

    Polygons that a fan from their first corner covers are cut into that fan, all at once; the concave ones
    are triangulated by manifold3d, which keeps every corner, so that neighbours still meet edge to edge.

    Args:
        vertices: Shape (n, 3).
        corners: The corners of all polygons, one after the other, shape (k,).
        sizes: How many of them each polygon has, shape (p,); those of less than 3 are left out.
    """
    if np.all(sizes == 3):
        return corners.reshape(-1, 3)
    begins = np.cumsum(sizes) - sizes
    triangles = [np.zeros((0, 3), dtype=np.int64)]
    for size in np.unique(sizes[sizes >= 3]):
        polygons = corners[begins[sizes == size][:, None] + np.arange(size)]
        fans = np.stack([np.repeat(polygons[:, :1], size - 2, 1), polygons[:, 1:-1], polygons[:, 2:]], axis=2)
        concave = _concave(vertices, fans) if size > 3 else np.zeros(len(polygons), dtype=bool)
        triangles.append(fans[~concave].reshape(-1, 3))
        triangles += [polygon[_ears(vertices[polygon])] for polygon in polygons[concave]]
    return np.concatenate(triangles)


def _concave(vertices: FloatArray, fans: IntArray) -> "np.ndarray[tuple[int, ...], np.dtype[np.bool_]]":
    """Whether a triangle of a polygon's fan turns the other way than the polygon, shape (p,)."""
    a, b, c = (vertices[fans[:, :, k]] for k in range(3))
    with np.errstate(all="ignore"):  # what is not finite is refused later
        normals = np.cross(b - a, c - a)
        turns = np.einsum("pij,pj->pi", normals, normals.sum(axis=1))
        return np.asarray(np.any(turns < 0.0, axis=1))


def _ears(points: FloatArray) -> IntArray:
    """Return triangles of one polygon as indices of its corners, shape (k - 2, 3)."""
    import manifold3d

    fan = np.stack(
        [np.zeros(len(points) - 2), np.arange(1, len(points) - 1), np.arange(2, len(points))], axis=1
    )
    if not np.all(np.isfinite(points)):
        return fan.astype(np.int64)
    centred = points - points.mean(axis=0)
    normal = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    drop = int(np.argmax(np.abs(normal)))
    # The two axes left, in the order in which the polygon runs anticlockwise.
    axes = [(drop + 1) % 3, (drop + 2) % 3] if normal[drop] > 0.0 else [(drop + 2) % 3, (drop + 1) % 3]
    ears = np.asarray(manifold3d.triangulate([np.ascontiguousarray(centred[:, axes])]), dtype=np.int64)
    return ears if len(ears) == len(points) - 2 else fan.astype(np.int64)
