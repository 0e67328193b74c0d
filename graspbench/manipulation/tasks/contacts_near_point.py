"""Grasp quality: keep contacts near a point of the object."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
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
    reach_m: Annotated[float, Field(gt=0, description="Distance beyond which the pull grows no more, m")] = (
        0.3
    )

    def evaluate(self, state: State) -> TaskValue:
        """Return the contacts' offsets from the target in the object frame, three rows a contact."""
        target, target_jacobian = np.array(self.point_m), 0.0
        if self.middle_of:
            others = list(self.middle_of)
            target = state.surface_points[others].mean(axis=0)
            target_jacobian = np.mean([_point_jacobian(state, i) for i in others], axis=0)
        offsets = [state.surface_points[i] - target for i in self.contacts]
        jacobian = np.vstack([_point_jacobian(state, i) - target_jacobian for i in self.contacts])
        pulls = [-offset / np.sqrt(1.0 + offset @ offset / self.reach_m**2) for offset in offsets]
        return TaskValue(np.concatenate(offsets), jacobian, np.concatenate(pulls))


def _point_jacobian(state: State, contact: int) -> FloatArray:
    """Velocity of a contact point over the object per unit of the variables, object frame, (3, n)."""
    return np.asarray(state.surface_tangents[contact] @ state.xi_jacobians[contact])
