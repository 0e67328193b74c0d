"""Closed-loop inverse kinematics of hand and object with prioritised tasks (thesis 4.4, figure 4.2)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.errors import ConfigurationError, ManipulationError
from graspbench.manipulation.contact_kinematics import ManipulationSystem, State
from graspbench.manipulation.integration import INTEGRATORS, step
from graspbench.manipulation.kernels import respond
from graspbench.manipulation.motion import PoseSample
from graspbench.manipulation.projection import prioritised_velocity
from graspbench.manipulation.qp import HierarchicalQP, QpParameters
from graspbench.manipulation.rotations import EULER_GUARD
from graspbench.manipulation.task import Task, smooth_step

Reference = Callable[[float], PoseSample]


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
    gain: Annotated[float, Field(gt=0, description="K of the object's position error, 1/s")] = 100.0
    rotation_gain: Annotated[float, Field(gt=0, description="K of its orientation error, 1/s")] = 100.0
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


@dataclass(frozen=True, eq=False)
class ClikHistory:
    """A motion as it was computed, one row a control period.

    Attributes:
        times: Shape (t,), s.
        joints: Shape (t, n_q), rad.
        contact_variables: [xi; theta] of each contact, shape (t, n_c, 5).
        velocities: z' at the start of each period, shape (t, n_variables).
        desired_positions: Desired position of the object's origin, shape (t, 3), m.
        desired_rotations: Desired orientation, shape (t, 3, 3).
        pose_errors: Desired minus actual pose, one loop a finger, shape (t, n_c, 6).
        object_positions: The object's origin as each finger has it, shape (t, n_c, 3).
        object_rotations: Its orientation, shape (t, n_c, 3, 3).
        closed_chain_residual_m: Largest disagreement of two fingers on the object's origin, shape (t,).
        smallest_singular_value: Of the extended Jacobian, shape (t,); NaN where not needed.
        activations: Largest activation of each task, shape (t, n_tasks).
        task_names: The tasks, in order of priority.
    """

    times: FloatArray
    joints: FloatArray
    contact_variables: FloatArray
    velocities: FloatArray
    desired_positions: FloatArray
    desired_rotations: FloatArray
    pose_errors: FloatArray
    object_positions: FloatArray
    object_rotations: FloatArray
    closed_chain_residual_m: FloatArray
    smallest_singular_value: FloatArray
    activations: FloatArray
    task_names: tuple[str, ...]


class Clik:
    """The control law: state in, variables' velocity out.

    Args:
        system: Hand, contacts and object.
        reference: Desired pose of the object by time.
        parameters: Method, gains, weights.
        tasks: Secondary tasks by name, in order of priority.

    Raises:
        ConfigurationError: The hand has fewer variables than the object's motion asks for, or a
            change of priorities does not name all tasks.
    """

    def __init__(
        self,
        system: ManipulationSystem,
        reference: Reference,
        parameters: ClikParameters,
        tasks: Mapping[str, Task] | None = None,
    ) -> None:
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
        self.system, self.reference, self.parameters = system, reference, parameters
        self.tasks = dict(tasks or {})
        names = tuple(self.tasks)
        self._orders = [(-np.inf, tuple(range(len(names))))]
        for change in sorted(parameters.priority_changes, key=lambda change: change.at_s):
            if sorted(change.order) != sorted(names):
                raise ConfigurationError(
                    f"the priorities from {change.at_s} s name {', '.join(change.order)}",
                    remedy=f"name all of {', '.join(names)} once",
                )
            self._orders.append((change.at_s, tuple(names.index(name) for name in change.order)))
        self.state = State(system)
        self.errors = np.zeros((system.n_contacts, 6))
        self.activations = np.zeros(len(names))
        self.smallest_singular_value = np.nan
        self.scale = _scale(system, parameters)
        self._gain = np.repeat([parameters.gain, parameters.rotation_gain], 3)
        self._wanted = np.zeros(m)
        self._transpose = self._feedback_only = parameters.method == "transpose"
        self._stack = _TaskStack(n)
        self._qp = (
            HierarchicalQP(system, parameters.qp, self.scale, parameters.step_s)
            if parameters.method == "qp"
            else None
        )

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
        state = self.state
        state.joints[:] = joints
        state.contact_variables[:] = contacts
        smallest = respond(
            self.system.arrays,
            state.joints,
            state.contact_variables,
            state.arrays,
            desired.position,
            desired.rotation,
            desired.twist,
            self._gain,
            self._feedback_only,
            self.errors,
            self._wanted,
        )
        if smallest < EULER_GUARD:
            state.refuse_singularity()
        values = [self._task_value(k, task, time_s) for k, task in enumerate(self.tasks.values())]
        before, after, share = self._order(time_s)
        velocity = self._solve(values, after)
        if share < 1.0:  # both velocities do the main task, and so does every mixture of them
            velocity = share * velocity + (1.0 - share) * self._solve(values, before)
        return velocity

    def _task_value(
        self, k: int, task: Task, time_s: float
    ) -> tuple[FloatArray, FloatArray, float | FloatArray] | None:
        presence = task.presence(time_s)
        self.activations[k] = 0.0
        value = task.evaluate(self.state) if presence > 0.0 else None
        if value is None:
            return None
        activation = presence * value.activation
        self.activations[k] = activation if isinstance(activation, float) else activation.max()
        return value.jacobian, task.gain * value.error, activation

    def _order(self, time_s: float) -> tuple[Sequence[int], Sequence[int], float]:
        """Return the order before and after the last change, and the share of the latter."""
        if len(self._orders) == 1:
            return self._orders[0][1], self._orders[0][1], 1.0
        last = max(k for k, (start, _) in enumerate(self._orders) if start <= time_s)
        if last == 0:
            return self._orders[0][1], self._orders[0][1], 1.0
        share = smooth_step((time_s - self._orders[last][0]) / self.parameters.transition_s)
        return self._orders[last - 1][1], self._orders[last][1], share

    def _solve(self, values: Sequence[Any], order: Sequence[int]) -> FloatArray:
        stack = self._stack
        stack.clear()
        for k in order:
            if values[k] is not None:
                stack.push(*values[k])
        out = np.empty(self.system.n_variables)
        self.smallest_singular_value = prioritised_velocity(
            self.state.jacobian,
            self._wanted,
            self.scale,
            self._transpose,
            self.parameters.singular_threshold,
            self.parameters.largest_damping,
            stack.jacobian,
            stack.wanted,
            stack.starts,
            stack.activation,
            stack.count,
            out,
        )
        if self._qp is not None:
            return self._qp.limit(self.state, out, self._wanted, stack.jacobians())
        return out


class _TaskStack:
    """Room for the active tasks' rows, one under the other."""

    def __init__(self, n: int) -> None:
        self.jacobian: FloatArray = np.zeros((16, n))
        self.wanted: FloatArray = np.zeros(16)
        self.starts: IntArray = np.zeros(17, dtype=np.int64)
        self.activation: FloatArray = np.zeros(16)
        self.count = 0

    def clear(self) -> None:
        self.count = 0

    def push(self, jacobian: FloatArray, wanted: FloatArray, activation: float | FloatArray) -> None:
        rows, start = len(wanted), int(self.starts[self.count])
        if start + rows > len(self.wanted):
            extra = start + rows
            self.jacobian = np.concatenate([self.jacobian, np.zeros((extra, self.jacobian.shape[1]))])
            self.wanted = np.concatenate([self.wanted, np.zeros(extra)])
            self.starts = np.concatenate([self.starts, np.zeros(extra, dtype=np.int64)])
            self.activation = np.concatenate([self.activation, np.zeros(extra)])
        self.jacobian[start : start + rows] = jacobian
        self.wanted[start : start + rows] = wanted
        if isinstance(activation, np.ndarray):  # every row is a block of its own
            first, last = self.count, self.count + rows
            self.activation[first:last] = activation
            self.starts[first + 1 : last + 1] = np.arange(start + 1, start + rows + 1)
            self.count = last
        else:
            self.activation[self.count] = activation
            self.count += 1
            self.starts[self.count] = start + rows

    def jacobians(self) -> list[FloatArray]:
        """Return the Jacobian of every block."""
        return [self.jacobian[self.starts[k] : self.starts[k + 1]] for k in range(self.count)]


def simulate(
    clik: Clik,
    joints: FloatArray,
    contact_variables: FloatArray,
    duration_s: float,
    *,
    watch: Callable[[Clik, int], None] | None = None,
) -> ClikHistory:
    """Run the loop over a fixed step and record it.

    Args:
        clik: The control law.
        joints: Start, shape (n_q,), rad.
        contact_variables: Start [xi; theta], shape (n_c, 5).
        duration_s: Length of the motion.
        watch: Called at the start of every period with the law, its state up to date, and the period.

    Raises:
        ManipulationError: A contact left its chart, or the law cannot go on.
    """
    system, period = clik.system, clik.parameters.step_s
    steps = round(duration_s / period)
    n_q, n_c = system.n_joints, system.n_contacts
    history = ClikHistory(
        np.linspace(0.0, period * steps, steps + 1),
        np.zeros((steps + 1, n_q)),
        np.zeros((steps + 1, n_c, 5)),
        np.zeros((steps + 1, system.n_variables)),
        np.zeros((steps + 1, 3)),
        np.zeros((steps + 1, 3, 3)),
        np.zeros((steps + 1, n_c, 6)),
        np.zeros((steps + 1, n_c, 3)),
        np.zeros((steps + 1, n_c, 3, 3)),
        np.zeros(steps + 1),
        np.full(steps + 1, np.nan),
        np.zeros((steps + 1, len(clik.tasks))),
        tuple(clik.tasks),
    )
    domains = np.array([contact.chart.domain for contact in system.contacts])
    rule = INTEGRATORS[clik.parameters.integrator]
    held = clik.parameters.reference == "held"
    q, eta = np.array(joints, dtype=np.float64), np.array(contact_variables, dtype=np.float64)
    for k, time in enumerate(history.times):
        desired = clik.reference(time)
        velocity = clik.respond(time, desired, q, eta)
        history.joints[k], history.contact_variables[k], history.velocities[k] = q, eta, velocity
        history.desired_positions[k], history.desired_rotations[k] = desired.position, desired.rotation
        history.pose_errors[k] = clik.errors
        history.object_positions[k] = clik.state.object_positions
        history.object_rotations[k] = clik.state.object_rotations
        history.smallest_singular_value[k] = clik.smallest_singular_value
        history.activations[k] = clik.activations
        if watch is not None:
            watch(clik, k)
        if k < steps:
            q, eta = step(clik, rule, time, period, q, eta, velocity, desired if held else None)
            outside = (eta[:, :2] < domains[:, :, 0]) | (eta[:, :2] > domains[:, :, 1])
            if outside.any() or not np.isfinite(q).all():
                contact = int(np.argmax(outside.any(axis=1)))
                raise ManipulationError(
                    f"contact {contact} left its surface chart after {time:.2f} s",
                    remedy="move the object less, or add the task edge_distance",
                    contact=contact,
                    time_s=float(time),
                )
    history.closed_chain_residual_m[:] = _residual(history.object_positions)
    return history


def _residual(positions: FloatArray) -> FloatArray:
    n = positions.shape[1]
    largest = np.zeros(len(positions))
    for i in range(n):
        for k in range(i):
            np.maximum(largest, np.linalg.norm(positions[:, i] - positions[:, k], axis=1), out=largest)
    return largest


def _scale(system: ManipulationSystem, parameters: ClikParameters) -> FloatArray:
    """1 / sqrt(weight) of every variable."""
    weight = np.full(system.n_variables, parameters.joint_weight)
    weight[system.xi_columns[system.xi_columns >= 0]] = parameters.sliding_weight
    weight[system.theta_columns[system.theta_columns >= 0]] = parameters.turning_weight
    return np.asarray(1.0 / np.sqrt(weight))
