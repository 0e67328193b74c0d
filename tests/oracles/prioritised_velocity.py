"""Prioritised velocities by plain dense linear algebra: every projector as a full matrix."""

import numpy as np

TASK_DAMPING = 1e-4
PROJECTOR_DAMPING = 1e-2


def prioritised_velocity(jacobian, wanted, scale, blocks):
    """Return z' for blocks (Jacobian, gain x error, activation), first priority first."""
    a = jacobian * scale
    m, n = a.shape
    velocity = np.linalg.pinv(a) @ wanted
    basis = np.linalg.svd(a)[2][m:]
    free = np.eye(n - m)
    for rows, task_wanted, h in blocks:
        own = rows * scale
        size = np.sum(own**2) / len(own) + 1e-30
        own_velocity = own.T @ np.linalg.solve(
            own @ own.T + TASK_DAMPING**2 * size * np.eye(len(own)), task_wanted
        )
        velocity = velocity + h * basis.T @ free @ basis @ own_velocity
        reduced = own @ basis.T @ free
        gram = reduced.T @ reduced
        kept = np.eye(n - m) - h * np.linalg.solve(gram + PROJECTOR_DAMPING**2 * size * np.eye(n - m), gram)
        free = kept @ free @ kept
    return velocity * scale
