"""Keep the grip forces away from the edges of the friction cones."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.grasp.quality import QualityParameters
from graspbench.manipulation.compiled.task_rows import smooth_step
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.forces import contact_frame
from graspbench.manipulation.secondary_task import TASKS, SecondaryTask, TaskValue, check_members
from graspbench.manipulation.task_geometry import contact_motion


@TASKS.register("cone_distance")
@dataclass(frozen=True, kw_only=True)
class ConeDistance(SecondaryTask):
    """Turn the grip force of a contact back into its cone once it is within the margin of the edge.

    The grip forces are those towards the middle of all contacts, in proportion to the distance from it: they
    are in balance whatever the grasp. The value is the angle from such a force to the cone's edge.
    """

    FOLLOWS: ClassVar[Mapping[str, str]] = {"friction": "quality.friction"}

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 2.0
    contacts: Annotated[tuple[int, ...], Field(description="Contacts to watch; all if empty")] = ()
    friction: Annotated[
        float | None, Field(gt=0, description="Friction coefficient; null: quality.friction")
    ] = None
    margin_deg: Annotated[
        float, Field(gt=0, le=90, description="Where the task begins, before the edge, deg")
    ] = 8.0

    def evaluate(self, state: State) -> TaskValue | None:
        """Return a row for every contact within the margin, or None where there is none."""
        system = state.system
        watched = self.contacts or tuple(range(system.n_contacts))
        check_members("cone_distance", "contacts", watched, system.n_contacts)
        friction = QualityParameters.friction if self.friction is None else self.friction
        margin, radii = math.radians(self.margin_deg), system.arrays.tip_radii
        normals = np.array([contact_frame(state, i)[0] for i in range(system.n_contacts)])
        motions = [contact_motion(state, i) for i in range(system.n_contacts)]
        points = state.tip_positions - radii[:, None] * normals
        rates = np.array([m.tip - r * m.normal for m, r in zip(motions, radii, strict=True)])
        inwards, inward_rates = points.mean(axis=0) - points, rates.mean(axis=0) - rates
        rows = []
        for i in watched:
            length = float(np.linalg.norm(inwards[i]))
            force = inwards[i] / length
            cosine = float(-normals[i] @ force)
            sine = math.sqrt(max(1.0 - cosine**2, 0.0))
            left = math.atan(friction) - math.acos(max(-1.0, min(1.0, cosine)))
            if left >= margin or sine < 1e-6:
                continue
            turning = (inward_rates[i] - np.outer(force, force @ inward_rates[i])) / length
            slope = -(normals[i] @ turning + force @ motions[i].normal) / sine
            rows.append((left, slope, margin - left, smooth_step(2.0 * (1.0 - left / margin))))
        if not rows:
            return None
        values, jacobian, errors, activations = (np.array(part) for part in zip(*rows, strict=True))
        return TaskValue(values, jacobian, errors, activations)
