"""The hierarchical QP form by a general solver (ProxQP), with nothing of the compiled one."""

import numpy as np
from proxsuite import proxqp

FAR = 1e8


def hierarchical_velocity(levels, near, low, high, rows, least):
    """Return the point in the limits that serves the levels in their order, ties towards ``near``.

    Args:
        levels: (matrix, wanted) of each level, first priority first; the last one is ``near`` itself.
        near: The projected velocity, shape (n,).
        low: Lower bounds, shape (n,).
        high: Upper bounds, shape (n,).
        rows: General limits, rows x >= least, shape (k, n).
        least: Shape (k,).
    """
    fixed, values, best = np.zeros((0, len(near))), np.zeros(0), None
    for matrix, wanted in [*levels, (np.eye(len(near)), near)]:
        found = _level(matrix, wanted, near, fixed, values, rows, least, low, high)
        if found is None:
            break
        best = found
        fixed = _row_space(np.vstack([fixed, matrix]))
        values = fixed @ best
        if len(fixed) == len(near):
            break
    return best


def _level(matrix, wanted, near, fixed, values, rows, least, low, high):
    tie, found = 1e-7, near
    hessian = matrix.T @ matrix + tie * np.eye(len(near))
    for _ in range(2):
        gradient = -(matrix.T @ wanted) - tie * found
        solver = proxqp.dense.QP(len(near), len(fixed), len(rows), True)
        solver.settings.eps_abs, solver.settings.eps_rel, solver.settings.max_iter = 1e-10, 0.0, 5000
        top = np.full(len(least), FAR)
        solver.init(hessian, gradient, fixed, values, rows, least, top, low, high)
        solver.solve()
        if solver.results.info.status != proxqp.PROXQP_SOLVED:
            return None if found is near else found
        found = np.array(solver.results.x)
    return found


def _row_space(matrix):
    _, values, right = np.linalg.svd(matrix, full_matrices=False)
    return right[values > 1e-8 * max(values.max(initial=0.0), 1e-12)]
