"""Fewer triangles for the same shape."""

from graspbench.arrays import FloatArray, IntArray
from graspbench.geometry.convex_union import manifold_arrays, to_manifold

MAX_KEPT_TRIANGLES = 20_000
"""A surface of this many triangles is finer than any camera or fingertip of a trial resolves."""


def simplify(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, float]:
    """Collapse the short edges of a closed mesh until it has at most ``MAX_KEPT_TRIANGLES``.

    Returns:
        Vertices, triangles, and the length of the edges collapsed, m; the mesh itself and 0 when nothing
        can be done or needs to be. A surface too rough for a few steps keeps more triangles.
    """
    if len(faces) <= MAX_KEPT_TRIANGLES:
        return vertices, faces, 0.0
    solid = to_manifold(vertices, faces)
    size = float((vertices.max(axis=0) - vertices.min(axis=0)).max())
    # What is far finer than wanted is far rougher, too, than a first step of so little could smooth.
    tolerance, effort, used = 1e-4 * size * max(1.0, len(faces) / 100_000), 0, 0.0
    while (
        not solid.is_empty() and (count := solid.num_tri()) > MAX_KEPT_TRIANGLES and tolerance < 0.02 * size
    ):
        if (effort := effort + count) > 3 * len(faces) + 1_000_000:
            break  # so rough that a millimetre's tolerance would not help: it would take minutes
        solid, used = solid.simplify(tolerance), tolerance
        # A step costs the same whatever it removes, so where it removed little the next is much longer.
        tolerance *= 1.5 if solid.num_tri() < 0.8 * count else 3.0
    if solid.is_empty() or solid.num_tri() >= len(faces):
        return vertices, faces, 0.0
    return *manifold_arrays(solid), used
