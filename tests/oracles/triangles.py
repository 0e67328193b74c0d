"""Brute force for triangle meshes, in exact rational arithmetic."""

from fractions import Fraction
from itertools import product


def crossing_triangles(vertices, faces):
    """Return the set of triangles that an edge of a triangle without common corner crosses."""
    points = [[Fraction(float(x)) for x in vertex] for vertex in vertices]
    hit = set()
    low, high = vertices[faces].min(axis=1), vertices[faces].max(axis=1)
    for a, b in product(range(len(faces)), repeat=2):
        if set(faces[a]) & set(faces[b]) or (low[a] > high[b]).any() or (low[b] > high[a]).any():
            continue
        for k in range(3):
            if _through(points[faces[a][k]], points[faces[a][(k + 1) % 3]], [points[i] for i in faces[b]]):
                hit |= {a, b}
    return hit


def _through(p, q, triangle):
    a, b, c = triangle
    if _volume(a, b, c, p) * _volume(a, b, c, q) >= 0:
        return False
    sides = [_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)]
    return all(side >= 0 for side in sides) or all(side <= 0 for side in sides)


def _volume(a, b, c, d):
    u, v, w = ([x - y for x, y in zip(point, a, strict=True)] for point in (b, c, d))
    return (
        u[0] * (v[1] * w[2] - v[2] * w[1])
        - u[1] * (v[0] * w[2] - v[2] * w[0])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
    )
