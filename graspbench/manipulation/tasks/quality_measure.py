"""Raise a quality measure of the grasp by moving the contacts."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.grasp.measure import MEASURES, GraspBatch, Measure
from graspbench.grasp.quality import QualityParameters
from graspbench.grasp.wrench import wrench_maps
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.secondary_task import TASKS, SecondaryTask, TaskValue

_STEP = 1e-5


@TASKS.register("quality_measure")
@dataclass(frozen=True, kw_only=True)
class QualityMeasure(SecondaryTask):
    """Climb a registered measure along its gradient over the contact coordinates (thesis 3.6 and 4.4).

    A measure of which less is better is lowered to the target.
    """

    FOLLOWS: ClassVar[Mapping[str, str]] = {
        "friction": "quality.friction",
        "cone_edges": "quality.cone_edges",
    }

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 1.0
    measure: Annotated[str, Field(description="Measure to raise; see graspbench measures list")] = "q1"
    target: Annotated[float, Field(description="Value to aim at; reached, the task pulls no more")] = 1.0
    friction: Annotated[
        float | None, Field(gt=0, description="Friction coefficient; null: quality.friction")
    ] = None
    cone_edges: Annotated[
        int | None, Field(ge=3, description="Edges of a friction cone; null: quality.cone_edges")
    ] = None
    torque_length: Annotated[float, Field(gt=0, description="Torques are divided by it, m")] = 0.05

    def __post_init__(self) -> None:
        _ = self._model  # an unknown measure is refused at once

    @cached_property
    def _model(self) -> tuple[Measure, QualityParameters]:
        quality = QualityParameters(
            friction=QualityParameters.friction if self.friction is None else self.friction,
            cone_edges=QualityParameters.cone_edges if self.cone_edges is None else self.cone_edges,
            torque_length=self.torque_length,
        )
        return MEASURES[self.measure], quality

    def evaluate(self, state: State) -> TaskValue | None:
        """Return the measure, or None where no contact can move."""
        system = state.system
        moving = [i for i in range(system.n_contacts) if state.xi_jacobians[i].any()]
        if not moving:
            return None
        variables = state.contact_variables
        base = [_geometry(state, i, variables[i, :2]) for i in range(system.n_contacts)]
        batch, steps = [base], []
        for i in moving:
            for k in range(2):
                # a step of the same length on any surface
                step = _STEP / float(np.linalg.norm(state.surface_tangents[i][:, k]))
                for sign in (-1.0, 1.0):
                    xi = variables[i, :2].copy()
                    xi[k] += sign * step * 0.05
                    batch.append([*base[:i], _geometry(state, i, xi), *base[i + 1 :]])
                steps.append(0.1 * step)
        geometry = np.array(batch)  # (n, n_c, 3, 3): point, inward normal, tangent
        maps = wrench_maps(
            geometry[:, :, 0],
            geometry[:, :, 1],
            np.zeros(3),
            contact="hard_finger",
            wrench_space="spatial",
            torque_length=self.torque_length,
            tangents=geometry[:, :, 2],
        )
        measure, quality = self._model
        values = measure.evaluate(
            GraspBatch(geometry[:, :, 0], geometry[:, :, 1], np.zeros(3), maps, quality, self.torque_length)
        )
        slopes = (values[2::2] - values[1::2]) / np.array(steps)
        jacobian = np.zeros((1, system.n_variables))
        for n, i in enumerate(moving):
            jacobian[0] += slopes[2 * n : 2 * n + 2] @ state.xi_jacobians[i]
        error = self.target - float(values[0])
        error = max(error, 0.0) if measure.better == "larger" else min(error, 0.0)
        return TaskValue(values[:1].copy(), jacobian, np.array([error]))


def _geometry(state: State, contact: int, xi: FloatArray) -> FloatArray:
    at = state.system.contacts[contact].chart(xi)
    return np.stack([at.point, -at.frame[:, 2], at.frame[:, 0]])
