"""The arrays of a control law and of its tasks, each in one block of memory (see `memory`)."""

from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.memory import matrix, shared, vector


class TaskArrays(NamedTuple):
    """The secondary tasks: what they are, and their rows at a state."""

    table: IntArray  # (t, 4): kind, first of its indices, first of its numbers, first of its rows
    separate: IntArray  # (t,) 1 if every row comes and goes on its own
    counts: IntArray  # (t,) rows now
    indices: IntArray  # (...,) of all kinds
    numbers: FloatArray  # (...,) gain, start, end, ramp, and what the kind has
    figures: FloatArray  # (r, 3) value, gain x error, activation 0 to 1
    activations: FloatArray  # (t,) the largest one of each task
    jacobian: FloatArray  # (r, n)


class LawArrays(NamedTuple):
    """A control law's settings, its result, and room to work."""

    transpose: FloatArray  # (1,) 1 for the transpose algorithm
    gain: FloatArray  # (6,) diagonal of K, 1/s
    damping: FloatArray  # (2,) singular value below which damping begins, and its largest factor
    scale: FloatArray  # (n,) 1 / sqrt(weight)
    errors: FloatArray  # (n_c, 6) pose errors, one loop a finger
    wanted: FloatArray  # (m,) G^T (v_d + K e), contacts stacked
    velocity: FloatArray  # (n,) z'
    contact_rates: FloatArray  # (n_c, 5) [xi'; theta']
    factors: FloatArray  # (m n,) LQ factors
    heads: FloatArray  # (m,)
    basis: FloatArray  # (n - m, n) of the main task's null space
    free: FloatArray  # (n - m, n - m)
    work: FloatArray  # (2 n,)


def new_task_blocks(
    table: IntArray, separate: IntArray, indices: IntArray, numbers: FloatArray, rows: int, n_variables: int
) -> tuple[FloatArray, IntArray]:
    """Return the two blocks of tasks with room for so many rows in all."""
    n_tasks = len(separate)
    sizes = np.array([n_tasks, rows, len(indices), len(numbers), n_variables], dtype=np.int64)
    whole = np.concatenate([sizes, table.ravel(), separate, np.zeros(n_tasks, dtype=np.int64), indices])
    return np.concatenate([numbers, np.zeros(3 * rows + n_tasks + rows * n_variables)]), whole


@shared
def task_arrays(numbers: FloatArray, indices: IntArray) -> TaskArrays:
    """Return the arrays of tasks in their two blocks, without copying."""
    tasks, rows, n = indices[0], indices[1], indices[4]
    table, at = matrix(indices, 5, tasks, 4)
    separate, at = vector(indices, at, tasks)
    counts, at = vector(indices, at, tasks)
    own_indices, at = vector(indices, at, indices[2])
    own_numbers, at = vector(numbers, 0, indices[3])
    figures, at = matrix(numbers, at, rows, 3)
    activations, at = vector(numbers, at, tasks)
    jacobian, at = matrix(numbers, at, rows, n)
    return TaskArrays(table, separate, counts, own_indices, own_numbers, figures, activations, jacobian)


def new_law_memory(n_contacts: int, rows: int, n_variables: int) -> FloatArray:
    """Return room for a law over contacts of so many rows each, all zeros."""
    c, m, n = n_contacts, rows * n_contacts, n_variables
    return np.zeros(9 + 4 * n + 11 * c + 2 * m + m * n + (n - m) * (2 * n - m))


@shared
def law_arrays(memory: FloatArray, sizes: IntArray) -> LawArrays:
    """Return the arrays of a law in its block, without copying; ``sizes`` starts the system's indices."""
    c, n = sizes[1], sizes[2]
    m = sizes[3] * c
    transpose, at = vector(memory, 0, 1)
    gain, at = vector(memory, at, 6)
    damping, at = vector(memory, at, 2)
    scale, at = vector(memory, at, n)
    errors, at = matrix(memory, at, c, 6)
    wanted, at = vector(memory, at, m)
    velocity, at = vector(memory, at, n)
    contact_rates, at = matrix(memory, at, c, 5)
    factors, at = vector(memory, at, m * n)
    heads, at = vector(memory, at, m)
    basis, at = matrix(memory, at, n - m, n)
    free, at = matrix(memory, at, n - m, n - m)
    work, at = vector(memory, at, 2 * n)
    return LawArrays(
        transpose,
        gain,
        damping,
        scale,
        errors,
        wanted,
        velocity,
        contact_rates,
        factors,
        heads,
        basis,
        free,
        work,
    )
