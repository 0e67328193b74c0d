"""Hierarchical quadratic programs: the same tasks with limits as hard inequalities (ProxQP).

Where the projected velocity meets all limits it is the answer. Otherwise the object's motion, then
each task in its order, then the rest are brought as close to that velocity as the limits allow, each
level without loss to those above. So the two forms agree where no limit is active, and join there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.manipulation.contact_kinematics import ManipulationSystem, State

_FAR = 1e8
_SLACK = 1e-9


@dataclass(frozen=True)
class DistanceLimit:
    """A least distance between the centres of two fingertips."""

    first: Annotated[int, Field(ge=0, description="One finger")]
    second: Annotated[int, Field(ge=0, description="The other finger")]
    minimum_m: Annotated[float, Field(gt=0, description="Least distance, m")]


@dataclass(frozen=True)
class QpParameters:
    """Hard limits of the hierarchical QP form: configuration group ``clik.qp``."""

    limit_gain: Annotated[
        float, Field(gt=0, description="Share of the way to a limit that may be gone in a second, 1/s")
    ] = 100.0
    distances: Annotated[
        tuple[DistanceLimit, ...], Field(description="Pairs of fingertips to keep apart")
    ] = ()
    distance_margin_m: Annotated[
        float, Field(ge=0, description="Added to a distance, for the curvature of a period's motion, m")
    ] = 1e-4
    tolerance: Annotated[float, Field(gt=0, description="Solver's absolute tolerance")] = 1e-9


class HierarchicalQP:
    """Solves level after level; keeps ProxQP's objects, because one that is reused is more reliable.

    Args:
        system: The system; its tree has the joint limits.
        parameters: Limits and tolerance.
        scale: 1 / sqrt(weight) of the variables, shape (n,).
        step_s: Control period; limits hold at its end if the velocity is held.
    """

    def __init__(
        self, system: ManipulationSystem, parameters: QpParameters, scale: FloatArray, step_s: float
    ) -> None:
        self.system, self.parameters, self.scale = system, parameters, scale
        self.limit_gain = min(parameters.limit_gain, 1.0 / step_s)
        self.levels_solved = 0
        self._solvers: dict[tuple[int, int, int], Any] = {}

    def bounds(self, state: State) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds of z', shape (n,) each.

        A joint beyond its limit has to come back, as fast as the limit's gain says but never faster than
        its velocity limit: so the box is never empty.
        """
        tree, gain = self.system.tree, self.limit_gain
        low, high = np.full((2, self.system.n_variables), [[-_FAR], [_FAR]])
        n_q, fastest = self.system.n_joints, tree.velocity_limits
        low[:n_q] = np.clip(gain * (tree.lower - state.joints), -fastest, fastest)
        high[:n_q] = np.clip(gain * (tree.upper - state.joints), -fastest, fastest)
        for i, contact in enumerate(self.system.contacts):
            for k in range(2):
                column = self.system.xi_columns[i, k]
                if column >= 0:
                    edges = contact.chart.domain[k] - state.contact_variables[i, k]
                    low[column], high[column] = gain * edges
        return np.maximum(low, -_FAR), np.minimum(high, _FAR)

    def distance_rows(self, state: State) -> tuple[FloatArray, FloatArray]:
        """Return C and d of C z' >= d, the distances' limits, shapes (k, n) and (k,)."""
        pairs = self.parameters.distances
        rows, least = np.zeros((len(pairs), self.system.n_variables)), np.zeros(len(pairs))
        for k, pair in enumerate(pairs):
            between = state.tip_positions[pair.second] - state.tip_positions[pair.first]
            distance = float(np.linalg.norm(between))
            relative = state.tip_jacobians[pair.second, :3] - state.tip_jacobians[pair.first, :3]
            rows[k, : self.system.n_joints] = between @ relative / max(distance, 1e-9)
            room = distance - pair.minimum_m - self.parameters.distance_margin_m
            least[k] = -self.limit_gain * room
        return rows, least

    def limit(
        self, state: State, projected: FloatArray, main: FloatArray, tasks: Sequence[FloatArray]
    ) -> FloatArray:
        """Return the admissible velocity that comes closest to ``projected``, by priority.

        Args:
            state: The system, evaluated.
            projected: z' of the projection method, shape (n,).
            main: The object's wanted contact velocities G^T (v_d + K e), shape (m,).
            tasks: Jacobians of the tasks, first priority first, each (rows, n).

        Raises:
            ManipulationError: The solver fails on the first level.
        """
        low, high = self.bounds(state)
        rows, least = self.distance_rows(state)
        inside = np.all(projected >= low - _SLACK) and np.all(projected <= high + _SLACK)
        self.levels_solved = 0
        if inside and np.all(rows @ projected >= least - _SLACK):
            return np.clip(projected, low, high)
        return self._solve_levels(state, projected, main, tasks)

    def _solve_levels(
        self, state: State, projected: FloatArray, main: FloatArray, tasks: Sequence[FloatArray]
    ) -> FloatArray:
        low, high = self.bounds(state)
        rows, least = self.distance_rows(state)
        scale = self.scale
        box = (low / scale, high / scale)
        near, rows = projected / scale, rows * scale
        levels = [(state.jacobian * scale, main)]
        levels += [(task * scale, task @ projected) for task in tasks]
        levels.append((np.eye(len(near)), near))
        fixed, values = np.zeros((0, len(near))), np.zeros(0)
        best: FloatArray | None = None
        for matrix, wanted in levels:
            found = self._level(matrix, wanted, near, fixed, values, rows, least, box)
            if found is None and best is None:
                least = self._relaxed(rows, least, box)
                found = self._level(matrix, wanted, near, fixed, values, rows, least, box)
            if found is None:
                break
            best = found
            self.levels_solved += 1
            # Independent directions only: ProxQP calls problems with dependent equalities infeasible.
            fixed = _row_space(np.vstack([fixed, matrix]))
            values = fixed @ best
            if len(fixed) == len(near):
                break
        if best is None:
            raise ManipulationError(
                "the quadratic program of the object's motion has no solution",
                remedy="relax the limits or slow the motion",
                joints=state.joints.copy(),
            )
        return np.clip(best * scale, low, high)

    def _level(
        self,
        matrix: FloatArray,
        wanted: FloatArray,
        near: FloatArray,
        fixed: FloatArray,
        values: FloatArray,
        rows: FloatArray,
        least: FloatArray,
        box: tuple[FloatArray, FloatArray],
    ) -> FloatArray | None:
        """Minimise |matrix x - wanted|^2, ties towards ``near``, with the levels above fixed.

        The second pass is a step of the proximal point method: it takes the tie's bias out of weak
        directions.
        """
        tie, found = 1e-7, near
        hessian = matrix.T @ matrix + tie * np.eye(len(near))
        for _ in range(2):
            gradient = -(matrix.T @ wanted) - tie * found
            solved = self._solve(hessian, gradient, fixed, values, rows, least, box)
            if solved is None:
                return None if found is near else found
            found = solved
        return found

    def _relaxed(self, rows: FloatArray, least: FloatArray, box: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Return the distances' bounds after the least squares of relaxing that the box asks for."""
        k, n = rows.shape
        hessian = np.diag(np.concatenate([np.full(n, 1e-6), np.ones(k)]))
        wide = (np.concatenate([box[0], np.zeros(k)]), np.concatenate([box[1], np.full(k, _FAR)]))
        with_slack = np.hstack([rows, np.eye(k)])
        none = np.zeros((0, n + k))
        found = self._solve(hessian, np.zeros(n + k), none, np.zeros(0), with_slack, least, wide)
        # As a last resort the distances give way altogether: the box always has a solution.
        return np.full(k, -_FAR) if found is None else least - np.maximum(found[n:], 0.0) - 1e-7

    def _solve(
        self,
        hessian: FloatArray,
        gradient: FloatArray,
        fixed: FloatArray,
        values: FloatArray,
        rows: FloatArray,
        least: FloatArray,
        box: tuple[FloatArray, FloatArray],
    ) -> FloatArray | None:
        from proxsuite import proxqp

        shape = (len(gradient), len(fixed), len(rows))
        high = np.full(len(least), _FAR)
        data = (hessian, gradient, fixed, values, rows, least, high, *box)
        solver = self._solvers.get(shape)
        if solver is None:
            solver = proxqp.dense.QP(*shape, True)
            solver.settings.eps_abs = self.parameters.tolerance
            solver.settings.eps_rel = 0.0
            solver.settings.max_iter = 2000
            solver.init(*data)
            self._solvers[shape] = solver
        else:
            solver.update(*data)
        solver.solve()
        if solver.results.info.status != proxqp.PROXQP_SOLVED:
            return None
        return np.array(solver.results.x)


def _row_space(matrix: FloatArray) -> FloatArray:
    """Return an orthonormal basis of a matrix's row space, shape (rank, n)."""
    _, values, right = np.linalg.svd(matrix, full_matrices=False)
    return np.asarray(right[values > 1e-8 * max(float(values.max(initial=0.0)), 1e-12)])
