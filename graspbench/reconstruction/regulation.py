"""Beyond the thesis: pull along the normals and even out the network, compiled."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.reconstruction.hull_fields import HullFields, critical_view, view_gradient

SLIDE_LIMIT = 0.35
"""Longest slide as a share of the nearest neighbour's distance: no node can pass another."""

NEAR_M = 0.5e-3
"""Distance below which a node goes straight to the border instead of along the surface's normal."""


@compiled
def regulate(
    points: FloatArray,
    normals: FloatArray,
    moved: FloatArray,
    fields: HullFields,
    contour_start: IntArray,
    contour_nodes: IntArray,
    sliding: float,
    attraction: float,
    longest_step: float,
    near: float,
) -> None:
    """Slide each node along the surface towards its longest and worst links, then pull it to the hull.

    The slide evens out the links and gathers nodes where the surface hangs between hull and hull;
    the pull along the normal takes these nodes where no pull to one centre would.

    Args:
        points: Node positions, shape (n_s, 3); overwritten by the new ones.
        normals: Outward unit normals, shape (n_s, 3).
        moved: Work space, shape (n_s, 3).
        fields: The visual hull.
        contour_start: See `SurfaceNetwork`.
        contour_nodes: See `SurfaceNetwork`.
        sliding: Share of the way to the weighted mean of its contour that a node slides.
        attraction: Weight a link gains per metre that its middle lies off the hull's border.
        longest_step: Bound on the pull's step (m).
        near: Distance to the border below which the pull goes along the hull's own normal (m).
    """
    for a in range(len(points)):
        x, y, z = points[a, 0], points[a, 1], points[a, 2]
        nx, ny, nz = normals[a, 0], normals[a, 1], normals[a, 2]
        if sliding > 0.0:
            sx = sy = sz = weights = 0.0
            nearest = np.inf
            for k in range(contour_start[a], contour_start[a + 1]):
                b = contour_nodes[k]
                dx, dy, dz = points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
                length = np.sqrt(dx * dx + dy * dy + dz * dz)
                nearest = min(nearest, length)
                _, gap = critical_view(fields, x + 0.5 * dx, y + 0.5 * dy, z + 0.5 * dz)
                weight = length * (1.0 + attraction * abs(gap))
                sx += weight * dx
                sy += weight * dy
                sz += weight * dz
                weights += weight
            share = sliding / weights if weights > 0.0 else 0.0
            along = sx * nx + sy * ny + sz * nz
            sx, sy, sz = share * (sx - along * nx), share * (sy - along * ny), share * (sz - along * nz)
            slide = np.sqrt(sx * sx + sy * sy + sz * sz)
            if slide > SLIDE_LIMIT * nearest:
                shrink = SLIDE_LIMIT * nearest / slide
                sx, sy, sz = sx * shrink, sy * shrink, sz * shrink
            x, y, z = x + sx, y + sy, z + sz
        view, distance = critical_view(fields, x, y, z)
        if abs(distance) < near:
            nx, ny, nz = view_gradient(fields, view, x, y, z)
        step = min(max(distance, -longest_step), longest_step)
        moved[a, 0], moved[a, 1], moved[a, 2] = x - step * nx, y - step * ny, z - step * nz
    # Loops here and elsewhere: assigning one array to another takes numba seconds to compile.
    for a in range(len(points)):
        for k in range(3):
            points[a, k] = moved[a, k]


@compiled
def uncovered(
    points: FloatArray,
    faces: IntArray,
    face_start: IntArray,
    node_faces: IntArray,
    samples: FloatArray,
    nearest: IntArray,
    worst: FloatArray,
    pulls: FloatArray,
) -> float:
    """Find how far samples of the hull's border lie from the surface, and what would reach them.

    Args:
        points: Node positions, shape (n_s, 3).
        faces: Triangles, shape (n_f, 3).
        face_start: Offsets into ``node_faces``, shape (n_s + 1,).
        node_faces: The faces around each node.
        samples: Points on the hull's border, shape (n, 3).
        nearest: The nodes nearest to each sample, the nearest first, shape (n, k).
        worst: Filled with the largest distance of a sample near each node, 0 for none, shape (n_s,).
        pulls: Filled with the vector from the surface to that sample, shape (n_s, 3).

    Returns:
        The largest distance of all (m).
    """
    worst[:] = 0.0
    pulls[:] = 0.0
    largest = 0.0
    for s in range(len(samples)):
        px, py, pz = samples[s, 0], samples[s, 1], samples[s, 2]
        best = np.inf
        bx = by = bz = 0.0
        for c in range(nearest.shape[1]):
            a = nearest[s, c]
            for k in range(face_start[a], face_start[a + 1]):
                f = node_faces[k]
                qx, qy, qz = _nearest_in_triangle(points, faces[f, 0], faces[f, 1], faces[f, 2], px, py, pz)
                square = (px - qx) ** 2 + (py - qy) ** 2 + (pz - qz) ** 2
                if square < best:
                    best = square
                    bx, by, bz = px - qx, py - qy, pz - qz
        distance = np.sqrt(best)
        a = nearest[s, 0]
        largest = max(largest, distance)
        if distance > worst[a]:
            worst[a] = distance
            pulls[a, 0], pulls[a, 1], pulls[a, 2] = bx, by, bz
    return largest


@compiled
def hanging(points: FloatArray, faces: IntArray, fields: HullFields) -> float:
    """Return how far the middle of a face or an edge lies from the hull's border at most (m)."""
    largest = 0.0
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        for wi, wj in ((1 / 3, 1 / 3), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5)):
            wk = 1.0 - wi - wj
            _, gap = critical_view(
                fields,
                wi * points[i, 0] + wj * points[j, 0] + wk * points[k, 0],
                wi * points[i, 1] + wj * points[j, 1] + wk * points[k, 1],
                wi * points[i, 2] + wj * points[j, 2] + wk * points[k, 2],
            )
            largest = max(largest, abs(gap))
    return largest


@inner
def _nearest_in_triangle(
    points: FloatArray, i: int, j: int, k: int, px: float, py: float, pz: float
) -> tuple[float, float, float]:
    """Return the point of a triangle nearest to p (Ericson, "Real-time collision detection", 5.1.5)."""
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    ux, uy, uz = points[j, 0] - ax, points[j, 1] - ay, points[j, 2] - az
    vx, vy, vz = points[k, 0] - ax, points[k, 1] - ay, points[k, 2] - az
    wx, wy, wz = px - ax, py - ay, pz - az
    d1 = ux * wx + uy * wy + uz * wz
    d2 = vx * wx + vy * wy + vz * wz
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    d3, d4 = d1 - uu, d2 - uv
    d5, d6 = d1 - uv, d2 - vv
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        s, t = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        s, t = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        s, t = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s, t = d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s, t = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s = 1.0 - t
    else:
        s, t = vb / (va + vb + vc), vc / (va + vb + vc)
    return ax + s * ux + t * vx, ay + s * uy + t * vy, az + s * uz + t * vz
