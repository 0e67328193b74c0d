"""Grasp quality: keep contacts near a point of the object."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.task import TASKS, CompiledTask, PackedTask, check_members
from graspbench.manipulation.task_kernels import CONTACTS_NEAR_POINT


@TASKS.register("contacts_near_point")
@dataclass(frozen=True, kw_only=True)
class ContactsNearPoint(CompiledTask):
    """Pull contacts over the surface towards a point, or towards the middle of other contacts."""

    KIND: ClassVar[int] = CONTACTS_NEAR_POINT

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

    def packed(self, system: ManipulationSystem) -> PackedTask:
        """Return three rows a contact: its offset from the target in the object frame."""
        named = (*self.contacts, *self.middle_of)
        check_members("contacts_near_point", "contacts", named, system.n_contacts)
        indices = (len(self.contacts), *self.contacts, len(self.middle_of), *self.middle_of)
        return PackedTask(indices, (*self.point_m, self.reach_m), 3 * len(self.contacts))
