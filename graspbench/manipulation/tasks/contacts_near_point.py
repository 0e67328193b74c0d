"""Grasp quality: keep contacts near a point of the object."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numba import njit
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.task import TASKS, Task, TaskValue


@TASKS.register("contacts_near_point")
@dataclass(frozen=True, kw_only=True)
class ContactsNearPoint(Task):
    """Pull contacts over the surface towards a point, or towards the middle of other contacts."""

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 1.0
    contacts: Annotated[tuple[int, ...], Field(min_length=1, description="Contacts to pull")] = (0,)
    middle_of: Annotated[
        tuple[int, ...], Field(description="Contacts whose mean is the target; empty: the point")
    ] = ()
    point_m: Annotated[tuple[float, float, float], Field(description="Target in the object frame, m")] = (
        0.0,
        0.0,
        0.0,
    )
    reach_m: Annotated[float, Field(gt=0, description="Distance beyond which the pull saturates, m")] = 0.3

    @cached_property
    def _given(self) -> tuple[IntArray, IntArray, FloatArray]:
        chosen = np.array(self.contacts, dtype=np.int64), np.array(self.middle_of, dtype=np.int64)
        return *chosen, np.array(self.point_m)

    def evaluate(self, state: State) -> TaskValue:
        """Return the contacts' offsets from the target in the object frame, three rows a contact."""
        rows = 3 * len(self.contacts)
        offsets, pulls = np.empty(rows), np.empty(rows)
        jacobian = np.zeros((rows, state.system.n_variables))
        _offsets(
            state.surface_points,
            state.surface_tangents,
            state.xi_jacobians,
            *self._given,
            self.reach_m,
            offsets,
            pulls,
            jacobian,
        )
        return TaskValue(offsets, jacobian, pulls)


@njit(cache=True)
def _offsets(
    points: FloatArray,
    tangents: FloatArray,
    xi_jacobians: FloatArray,
    contacts: IntArray,
    middle_of: IntArray,
    point: FloatArray,
    reach: float,
    offsets: FloatArray,
    pulls: FloatArray,
    jacobian: FloatArray,
) -> None:
    """Write c_i - target, the pull against it (its length bounded by the reach) and the Jacobian."""
    target = point.copy()
    if len(middle_of) > 0:
        target[:] = 0.0
    for other in middle_of:
        for a in range(3):
            target[a] += points[other, a] / len(middle_of)
    for n in range(len(contacts)):
        i, length = contacts[n], 0.0
        for a in range(3):
            offsets[3 * n + a] = points[i, a] - target[a]
            length += offsets[3 * n + a] ** 2
            _add_point_rates(tangents[i, a], xi_jacobians[i], 1.0, jacobian[3 * n + a])
            for other in middle_of:
                share = -1.0 / len(middle_of)
                _add_point_rates(tangents[other, a], xi_jacobians[other], share, jacobian[3 * n + a])
        for a in range(3):
            pulls[3 * n + a] = -offsets[3 * n + a] / np.sqrt(1.0 + length / (reach * reach))


@njit(cache=True)
def _add_point_rates(tangent: FloatArray, xi_jacobian: FloatArray, share: float, row: FloatArray) -> None:
    for k in range(2):
        for v in range(len(row)):
            row[v] += share * tangent[k] * xi_jacobian[k, v]
