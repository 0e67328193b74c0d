"""What tasks' kernels share: smooth steps, rows, margins."""

from graspbench.compiled import inner
from graspbench.manipulation.compiled.shared import shared
from graspbench.manipulation.compiled.step_records import StateArrays, TaskArrays


@shared
def smooth_step(x: float) -> float:
    """Return 0 below 0, 1 above 1, and the fifth-order polynomial with flat ends in between."""
    x = min(max(x, 0.0), 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@inner
def open_row(task: TaskArrays, row: int, value: float, error: float, activation: float) -> None:
    """Write a row's figures and clear its Jacobian."""
    task.values[row], task.errors[row], task.activations[row] = value, error, activation
    jacobian = task.jacobian
    for v in range(jacobian.shape[1]):
        jacobian[row, v] = 0.0


@inner
def beyond(x: float, lower: float, upper: float, margin: float) -> tuple[float, float]:
    """Return how deep x is inside a margin (none if not positive), and the way back out."""
    above, below = x - (upper - margin), (lower + margin) - x
    return (above, -above) if above > below else (below, below)


@inner
def add_point_rates(
    state: StateArrays, contact: int, axis: int, share: float, task: TaskArrays, row: int
) -> None:
    """Add a share of the rates of a contact's point, along an axis of the object, to a row."""
    tangents, rates, jacobian = state.surface_tangents, state.xi_jacobians, task.jacobian
    for k in range(2):
        tangent = share * tangents[contact, axis, k]
        for v in range(jacobian.shape[1]):
            jacobian[row, v] += tangent * rates[contact, k, v]


@inner
def weigh(task: TaskArrays, count: int, time_s: float) -> float:
    """Multiply a task's errors by its gain, its activations by its presence; return the largest of these."""
    presence = smooth_step((time_s - task.start_s) / task.ramp_s)
    if time_s > task.end_s:
        presence *= 1.0 - smooth_step((time_s - task.end_s) / task.ramp_s)
    largest, errors, activations = 0.0, task.errors, task.activations
    for r in range(count):
        errors[r] *= task.gain
        activations[r] *= presence
        largest = max(largest, activations[r])
    return largest
