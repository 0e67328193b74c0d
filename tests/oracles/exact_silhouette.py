"""Exact silhouettes: the union of a mesh's projected triangles, point by point in double precision."""

import numpy as np
from numba import njit


def exact_mask(vertices, faces, camera, subdivisions=1):
    """Return the fraction of each pixel's sample points that the mesh covers, shape (height, width).

    Sample points are the centres of subdivisions^2 equal squares in each pixel.
    """
    k, n = camera.intrinsics, subdivisions
    uv = camera.project(np.asarray(vertices, dtype=np.float64)) * n - 0.5
    hit = np.zeros((k.height * n, k.width * n), dtype=np.bool_)
    _fill(uv, np.asarray(faces, dtype=np.int64), hit)
    return hit.reshape(k.height, n, k.width, n).mean(axis=(1, 3))


def iou(a, b):
    """Return intersection over union of two masks."""
    return np.logical_and(a, b).sum() / np.logical_or(a, b).sum()


@njit(cache=True)
def _fill(uv, faces, hit):
    """Mark all whole-numbered points inside some triangle."""
    for face in faces:
        ax, ay = uv[face[0]]
        bx, by = uv[face[1]]
        cx, cy = uv[face[2]]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        top = max(int(np.ceil(min(ay, by, cy))), 0)
        bottom = min(int(np.floor(max(ay, by, cy))), hit.shape[0] - 1)
        left = max(int(np.ceil(min(ax, bx, cx))), 0)
        right = min(int(np.floor(max(ax, bx, cx))), hit.shape[1] - 1)
        for r in range(top, bottom + 1):
            for c in range(left, right + 1):
                wa = ((bx - c) * (cy - r) - (by - r) * (cx - c)) / area
                wb = ((cx - c) * (ay - r) - (cy - r) * (ax - c)) / area
                if wa >= 0.0 and wb >= 0.0 and wa + wb <= 1.0:
                    hit[r, c] = True
