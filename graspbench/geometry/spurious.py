"""Handles and tunnels of a closed body that are too thin to be meant, taken away."""

from __future__ import annotations

from graspbench.arrays import FloatArray, IntArray
from graspbench.geometry.gaps import close_holes
from graspbench.geometry.handles import cut_spurious_handles
from graspbench.geometry.inspection import counted, inspect

_MAX_ROUNDS = 20
"""Times that spurious handles are looked for; a surface that has more of them then is beyond repair."""


def without_spurious_handles(
    vertices: FloatArray, faces: IntArray, name: str, done: list[str]
) -> tuple[FloatArray, IntArray]:
    """Cut handles and fill tunnels of one closed body that are too thin to be meant.

    Args:
        vertices: Shape (n, 3), m.
        faces: Shape (m, 3).
        name: What to call it in sentences.
        done: What was done is added to it.
    """
    vertices, faces, report = inspect(vertices, faces, name, trusted=True)
    cut: list[float] = []
    for _ in range(min(report.genus or 0, _MAX_ROUNDS)):
        vertices, faces, lengths = cut_spurious_handles(vertices, faces)
        if not lengths:
            break
        vertices, faces, _, _ = close_holes(vertices, faces)
        cut += lengths
        if len(cut) >= (report.genus or 0):
            break
    if cut:
        girths = _span_mm(cut)
        done.append(f"{counted(len(cut), 'spurious handle')} cut, {girths} around")
    return vertices, faces


def _span_mm(lengths: list[float]) -> str:
    low, high = f"{1e3 * min(lengths):.1f}", f"{1e3 * max(lengths):.1f}"
    return f"{low} mm" if low == high else f"{low} to {high} mm"
