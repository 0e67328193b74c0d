"""Directions spread evenly over the sphere."""

import numpy as np

from graspbench.arrays import FloatArray


def even_directions(count: int) -> FloatArray:
    """Return unit vectors spread evenly over the sphere (a Fibonacci lattice), shape (count, 3)."""
    i = np.arange(count)
    z = 1 - 2 * (i + 0.5) / count
    angle = i * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
