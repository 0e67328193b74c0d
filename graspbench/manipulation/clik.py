"""Closed-loop inverse kinematics of hand and object with prioritised tasks (thesis 4.4, figure 4.2)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError
from graspbench.manipulation.compiled.control_step import Stage, control_step
from graspbench.manipulation.compiled.step_records import LawArrays
from graspbench.manipulation.compiled.task_rows import smooth_step
from graspbench.manipulation.contact_kinematics import ManipulationSystem, State
from graspbench.manipulation.pose_sample import PoseSample
from graspbench.manipulation.qp import HierarchicalQP, QpParameters
from graspbench.manipulation.secondary_task import SecondaryTask
from graspbench.manipulation.task_set import TaskSet
from graspbench.manipulation.transpose_gain import stable_gains

_GAIN = 100.0

Reference = Callable[[float], PoseSample]
Lead = Callable[[float, FloatArray], FloatArray]
"""Rates at which contacts are led, shape (n_c, 2), for a time and the contacts' variables, shape (n_c, 5)."""


@dataclass(frozen=True)
class PriorityChange:
    """From a time on, the tasks have another order."""

    at_s: Annotated[float, Field(ge=0, description="When the change begins, s")]
    order: Annotated[tuple[str, ...], Field(description="Names of all tasks, first priority first")]


@dataclass(frozen=True)
class ClikParameters:
    """Inverse kinematics of hand and object: configuration group ``clik``."""

    method: Annotated[
        Literal["pseudo_inverse", "transpose", "qp"],
        Field(description="Right pseudo-inverse (4.10), transpose (4.12), or hierarchical QP"),
    ] = "pseudo_inverse"
    gain: Annotated[
        float | None,
        Field(
            gt=0,
            description="K of the position error, 1/s; null: 100, or what the Jacobian allows (transpose)",
        ),
    ] = None
    rotation_gain: Annotated[
        float | None, Field(gt=0, description="K of its orientation error, 1/s; null: likewise")
    ] = None
    step_s: Annotated[float, Field(gt=0, description="Control period, s")] = 1e-3
    integrator: Annotated[
        Literal["euler", "heun", "rk4"], Field(description="Fixed-step rule of order 1, 2 or 4")
    ] = "heun"
    reference: Annotated[
        Literal["continuous", "held"],
        Field(description="Desired pose inside a period: as it runs, or held since its start"),
    ] = "continuous"
    joint_weight: Annotated[float, Field(gt=0, description="Cost of joint motion")] = 1.0
    sliding_weight: Annotated[float, Field(gt=0, description="Cost of contact motion on the surface")] = 1.0
    turning_weight: Annotated[float, Field(gt=0, description="Cost of ball joint motion")] = 1.0
    singular_threshold: Annotated[
        float, Field(ge=0, description="Damping begins below this smallest singular value")
    ] = 1e-3
    largest_damping: Annotated[float, Field(ge=0, description="Damping factor at a singularity")] = 1e-2
    transition_s: Annotated[float, Field(gt=0, description="How long a change of priorities takes, s")] = 0.5
    priority_changes: Annotated[
        tuple[PriorityChange, ...], Field(description="Changes of the tasks' order, by time")
    ] = ()
    qp: Annotated[QpParameters, Field(description="The hierarchical QP form")] = field(
        default_factory=QpParameters
    )
    tasks: Annotated[
        Mapping[str, Mapping[str, Any]], Field(description="Secondary tasks by name, with their options")
    ] = field(default_factory=dict)


class Clik:
    """The control law: state in, variables' velocity out.

    Args:
        system: Hand, contacts and object.
        reference: Desired pose of the object by time.
        parameters: Method, gains, weights.
        tasks: Secondary tasks by name, in order of priority.
        lead: How the contacts that are led run over the surface; None without such contacts.

    Raises:
        ConfigurationError: The hand has fewer variables than the object's motion asks for, a change of
            priorities does not name all tasks, or a task does not fit the hand.

    Attributes:
        system: As given.
        reference: As given.
        parameters: As given.
        tasks: As given.
        state: The configuration last asked for.
        errors: Its pose errors, one loop a finger, shape (n_c, 6).
        wanted: G^T (v_d + K e) of all contacts, shape (m,).
        last_velocity: z' that was last returned, shape (n_variables,).
        led_rates: xi' of the contacts that are led, 0 for all others, shape (n_c, 2).
        contact_rates: [xi'; theta'] of that velocity, shape (n_c, 5).
        activations: Largest activation of each task, shape (n_tasks,).
        scale: 1 / sqrt(weight) of the variables, shape (n_variables,).
        smallest_singular_value: Estimate for the scaled extended Jacobian; NaN where not needed.
    """

    def __init__(
        self,
        system: ManipulationSystem,
        reference: Reference,
        parameters: ClikParameters,
        tasks: Mapping[str, SecondaryTask] | None = None,
        *,
        lead: Lead | None = None,
    ) -> None:
        _check(system, parameters)
        self.system, self.reference, self.parameters = system, reference, parameters
        self.tasks = dict(tasks or {})
        self.state = State(system)
        self._lead = lead
        self._given_gains = (parameters.gain, parameters.rotation_gain)
        self._gains_are_due = parameters.method == "transpose" and None in self._given_gains
        free = system.n_variables - system.rows * system.n_contacts
        self._law = law = LawArrays(
            sizes={**system.sizes, "free": free},
            transpose=parameters.method == "transpose",
            limited=parameters.method == "qp",
            singular_threshold=parameters.singular_threshold,
            largest_damping=parameters.largest_damping,
            gain=np.repeat([g or _GAIN for g in self._given_gains], 3),
            scale=_scale(system, parameters),
        )
        self.scale, self.errors, self.wanted = law.scale, law.errors, law.wanted
        self.contact_rates, self.last_velocity = law.contact_rates, law.velocity
        self.led_rates = law.led_rates
        self.smallest_singular_value = np.nan
        self._task_set = TaskSet(self.tasks, system)
        self._orders = _orders(self._task_set.names, parameters.priority_changes)
        self._qp = (
            HierarchicalQP(system, parameters.qp, parameters.step_s) if parameters.method == "qp" else None
        )

    @property
    def activations(self) -> FloatArray:
        """Largest activation of each task, shape (n_tasks,)."""
        return self._task_set.table.activations

    def velocity(self, time_s: float, joints: FloatArray, contacts: FloatArray) -> FloatArray:
        """Return z' at a time and configuration, shape (n_variables,)."""
        return self.respond(time_s, self.reference(time_s), joints, contacts)

    def respond(
        self, time_s: float, desired: PoseSample, joints: FloatArray, contacts: FloatArray
    ) -> FloatArray:
        """Return z' for a given desired pose.

        Raises:
            ManipulationError: A ball joint is at its singularity, or the QP has no solution.
        """
        state, stage = self.state, Stage.STATE
        if self._task_set.in_python:
            state.update(joints, contacts)
            self._task_set.evaluate_in_python(state, time_s)
            stage = Stage.TASKS
        else:
            state.joints[:] = joints
            state.contact_variables[:] = contacts
        if self._gains_are_due:
            self._choose_gains(joints, contacts)
        if self._lead is not None:
            self.led_rates[:] = self._lead(time_s, contacts)
        before, after, share = self._order(time_s)
        velocity = self._solve(time_s, desired, after, stage)
        if share < 1.0:  # both velocities do the main task, and so does every mixture of them
            rates = self.contact_rates.copy()
            velocity = share * velocity + (1.0 - share) * self._solve(time_s, desired, before, Stage.VELOCITY)
            self.contact_rates[:] = share * rates + (1.0 - share) * self.contact_rates
            self.last_velocity[:] = velocity
        return velocity

    def _choose_gains(self, joints: FloatArray, contacts: FloatArray) -> None:
        """Fill in the gains that were not given, from the Jacobian where the motion starts."""
        self.state.update(joints, contacts)
        chosen = stable_gains(self.state, self.scale, self.parameters.step_s)
        gains = [given or own for given, own in zip(self._given_gains, chosen, strict=True)]
        self._law.gain[:] = np.repeat(gains, 3)
        self._gains_are_due = False

    def _order(self, time_s: float) -> tuple[IntArray, IntArray, float]:
        """Return the order before and after the last change, and the share of the latter."""
        last = len(self._orders) - 1
        while last > 0 and self._orders[last][0] > time_s:
            last -= 1
        if last == 0:
            return self._orders[0][1], self._orders[0][1], 1.0
        share = smooth_step((time_s - self._orders[last][0]) / self.parameters.transition_s)
        return self._orders[last - 1][1], self._orders[last][1], share

    def _solve(self, time_s: float, desired: PoseSample, order: IntArray, stage: Stage) -> FloatArray:
        self.smallest_singular_value = control_step(
            self.system.arrays.block,
            self.state.block,
            self._law.block,
            self._task_set.table.block,
            order,
            desired,
            time_s,
            int(stage),
        )
        if self.smallest_singular_value < 0.0:
            self.state.refuse_singularity()
        if self._qp is not None:
            self._qp.limit(self.state, self._law, self._task_set.table, order)
        return self.last_velocity.copy()


def _check(system: ManipulationSystem, parameters: ClikParameters) -> None:
    n, m = system.n_variables, system.rows * system.n_contacts
    if m > n:
        raise ConfigurationError(
            f"the contacts fix {m} velocities but hand and contacts have {n} variables",
            remedy="use contacts with more freedom or fingers with more joints",
        )
    if parameters.method == "qp" and parameters.integrator != "euler":
        raise ConfigurationError(
            "limits hold in the QP form only when its velocity is held over the period",
            remedy="set clik.integrator=euler",
        )


def _orders(names: tuple[str, ...], changes: Sequence[PriorityChange]) -> list[tuple[float, IntArray]]:
    """Return the tasks' orders with the times from which they hold."""
    orders = [(-np.inf, np.arange(len(names), dtype=np.int64))]
    for change in sorted(changes, key=lambda change: change.at_s):
        if sorted(change.order) != sorted(names):
            raise ConfigurationError(
                f"the priorities from {change.at_s} s name {', '.join(change.order)}",
                remedy=f"name all of {', '.join(names)} once",
            )
        order = np.array([names.index(name) for name in change.order], dtype=np.int64)
        orders.append((change.at_s, order))
    return orders


def _scale(system: ManipulationSystem, parameters: ClikParameters) -> FloatArray:
    """1 / sqrt(weight) of every variable."""
    weight = np.full(system.n_variables, parameters.joint_weight)
    weight[system.xi_columns[system.xi_columns >= 0]] = parameters.sliding_weight
    weight[system.theta_columns[system.theta_columns >= 0]] = parameters.turning_weight
    return np.asarray(1.0 / np.sqrt(weight))
