"""What is left of a space when directions are taken out of it, one by one, level by level."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner


@inner
def remove_direction(
    basis: FloatArray, k: int, direction: FloatArray, part: FloatArray, independent: float
) -> bool:
    """Turn an orthonormal basis by one reflection so that its first k - 1 rows are free of a direction.

    Args:
        basis: Rows, the first ``k`` of which span what is left, shape (>= k, n); changed in place.
        k: Number of directions left.
        direction: What to take out, shape (n,).
        part: Work space, shape (>= k,).
        independent: Squared share of the direction within the basis below which it counts as taken out.

    Returns:
        Whether the direction was within the basis.
    """
    size = basis.shape[1]
    norm = 0.0
    for b in range(size):
        norm += direction[b] ** 2
    length = 0.0
    for a in range(k):
        value = 0.0
        for b in range(size):
            value += basis[a, b] * direction[b]
        part[a] = value
        length += value**2
    if length <= independent * norm or k == 0:
        return False
    length = np.sqrt(length)
    part[k - 1] += length if part[k - 1] >= 0.0 else -length
    scale = 0.0
    for a in range(k):
        scale += part[a] ** 2
    scale = 2.0 / scale
    for b in range(size):
        value = 0.0
        for a in range(k):
            value += part[a] * basis[a, b]
        value *= scale
        for a in range(k - 1):
            basis[a, b] -= value * part[a]
    return True


@inner
def remove_directions(
    free: FloatArray,
    dims: IntArray,
    level: int,
    directions: FloatArray,
    count: int,
    part: FloatArray,
    independent: float,
) -> bool:
    """Take directions out of what is left at a level, and write what is left then to the next level.

    Args:
        free: Orthonormal rows of each level, shape (n_levels, n, n).
        dims: How many rows are left at each level, shape (n_levels,).
        level: Where to start from.
        directions: What to take out, shape (>= count, n).
        count: How many.
        part: Work space, shape (n,).
        independent: See `remove_direction`.

    Returns:
        Whether each of them was within what was left; if not, the next level is of no use.
    """
    size = free.shape[2]
    k = dims[level]
    basis = free[level + 1]
    for a in range(k):
        for b in range(size):
            basis[a, b] = free[level, a, b]
    for r in range(count):
        if not remove_direction(basis, k, directions[r], part, independent):
            return False
        k -= 1
    dims[level + 1] = k
    return True
