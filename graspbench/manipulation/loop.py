"""The control loop over time: fixed-step integration of the law, and what is kept of it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.manipulation.clik import Clik
from graspbench.manipulation.integration import INTEGRATORS, step


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
