"""The plane of contacts, and how far the planes of contacts near them turn from it."""

import math

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.compiled import inner


@inner
def contact_plane(points: FloatArray, error: float, frame: FloatArray) -> float:
    """Write the least squares plane of contacts, and return how far planes of near contacts turn from it.

    Args:
        points: Shape (n_f, 3).
        error: Root of the summed squares of how far the contacts may be from the points.
        frame: Written: two unit vectors in the plane, and its normal, shape (3, 3).

    Returns:
        Chord of the largest angle, at most the square root of two: the normal's sign is of no meaning.
    """
    n_f = points.shape[0]
    if n_f == 3:
        return _plane_of_three(points, error, frame)
    spread = np.zeros((3, 3))
    for i in range(n_f):
        for j in range(i):
            for a in range(3):
                for b in range(3):
                    gap = (points[i, a] - points[j, a]) * (points[i, b] - points[j, b])
                    spread[a, b] += gap / n_f
    values, vectors = np.linalg.eigh(spread)
    for k in range(3):
        for j in range(3):
            frame[j, k] = vectors[k, 2 - j]
    least, second = math.sqrt(max(values[0], 0.0)), math.sqrt(max(values[1], 0.0))
    if n_f == 2 or second <= 1e-6 * math.sqrt(max(values[2], 1e-300)):
        return math.sqrt(2.0)
    widest = second * second - least * least
    return _chord(math.sqrt((4.0 * error * least + 4.0 * error * error) / max(widest, 1e-300)))


@inner
def _plane_of_three(points: FloatArray, error: float, frame: FloatArray) -> float:
    """See `_plane`; three contacts lie in their plane, so their spread out of it is error alone."""
    longest, size, total = 0.0, 0.0, 0.0
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        first, second = points[1, k] - points[0, k], points[2, k] - points[0, k]
        frame[0, k] = first
        longest += first * first
        total += (first * first + second * second + (first - second) ** 2) / 3.0
        frame[2, k] = (points[1, a] - points[0, a]) * (points[2, b] - points[0, b])
        frame[2, k] -= (points[1, b] - points[0, b]) * (points[2, a] - points[0, a])
        size += frame[2, k] ** 2
    longest, size = math.sqrt(longest), math.sqrt(size)
    second = 0.5 * total - math.sqrt(max(0.25 * total * total - size * size / 3.0, 0.0))
    if size <= 1e-7 * total or longest <= 1e-9:
        frame[:] = np.eye(3)
        return math.sqrt(2.0)
    for k in range(3):
        frame[0, k] /= longest
        frame[2, k] /= size
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        frame[1, k] = frame[2, a] * frame[0, b] - frame[2, b] * frame[0, a]
    return _chord(error / math.sqrt(max(second, 1e-300)))


@inner
def _chord(sine: float) -> float:
    """Return the chord of the angle of a sine; of a right angle from one on."""
    return 2.0 * math.sin(0.5 * math.asin(sine)) if sine < 1.0 else math.sqrt(2.0)
