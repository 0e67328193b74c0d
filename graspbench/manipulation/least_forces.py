"""The quadratic programme of the contact forces: the least that balance a load within linear bounds."""

from typing import Any

import numpy as np

from graspbench.arrays import FloatArray

_TOLERANCE = 1e-9
_MAX_ITERATIONS = 2000


class LeastForces:
    """Least squares under equations and bounds (ProxQP); similar problems in a row start warm."""

    def __init__(self) -> None:
        self._solver: Any = None
        self._shape: tuple[int, int, int] = (0, 0, 0)

    def __call__(
        self, grasp: FloatArray, load: FloatArray, rows: FloatArray, highs: FloatArray
    ) -> FloatArray | None:
        """Return the x of least norm with grasp x = load and rows x <= highs, None if there is none.

        The equations hold down to rounding, the bounds within 1e-9.

        Args:
            grasp: Wrenches of the unknowns, shape (6, n) or (3, n).
            load: Shape (6,) or (3,).
            rows: Shape (k, n).
            highs: Shape (k,).
        """
        # ProxQP calls problems with dependent equality rows infeasible: keep independent ones only.
        basis, values, _ = np.linalg.svd(grasp)
        rank = int(np.sum(values > 1e-9 * values[0]))
        if np.abs(basis[:, rank:].T @ load).max(initial=0.0) > 1e-7 * max(float(np.abs(load).max()), 1.0):
            return None
        # Forces (N) and torques (N m) differ a hundredfold; the solver needs rows of one length.
        scaled = basis[:, :rank] / values[:rank]
        grasp, load = scaled.T @ grasp, scaled.T @ load
        n = grasp.shape[1]
        shape = (n, rank, len(highs))
        data = (np.eye(n), np.zeros(n), grasp, load, rows, np.full(len(highs), -1e20), highs)
        warm = self._solver is not None and shape == self._shape
        solved = self._again(data) if warm else False
        # A warm start must not decide that there are none, nor must ProxQP alone: its test calls problems
        # infeasible whose forces come near their bounds, and without that test it is slow to give up.
        solved = solved or self._afresh(shape, data, infeasible_below=1e-4)
        if not solved and _is_feasible(grasp, load, rows, highs):
            solved = self._afresh(shape, data, infeasible_below=0.0)
        if not solved:
            self._solver = None
            return None
        x = np.array(self._solver.results.x)
        # the equations' rows are orthonormal
        return np.asarray(x - grasp.T @ (grasp @ x - load))

    def _again(self, data: tuple[FloatArray, ...]) -> bool:
        self._solver.update(*data)
        return self._solved()

    def _afresh(
        self, shape: tuple[int, int, int], data: tuple[FloatArray, ...], infeasible_below: float
    ) -> bool:
        from proxsuite import proxqp

        self._solver, self._shape = proxqp.dense.QP(*shape), shape
        self._solver.settings.eps_abs = _TOLERANCE
        self._solver.settings.eps_rel = 0.0
        self._solver.settings.max_iter = _MAX_ITERATIONS
        self._solver.settings.eps_primal_inf = infeasible_below
        self._solver.init(*data)
        return self._solved()

    def _solved(self) -> bool:
        from proxsuite import proxqp

        self._solver.solve()
        return bool(self._solver.results.info.status == proxqp.PROXQP_SOLVED)


def _is_feasible(grasp: FloatArray, load: FloatArray, rows: FloatArray, highs: FloatArray) -> bool:
    from scipy.optimize import linprog

    n = grasp.shape[1]
    found = linprog(np.zeros(n), rows, highs, grasp, load, bounds=(None, None), method="highs")
    return bool(found.status == 0)
