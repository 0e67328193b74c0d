"""The transpose algorithm's gains, chosen from the Jacobian (thesis 4.12)."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.manipulation.contact_kinematics import State

_STEP_TIMES_RATE = 0.8
"""Period times the fastest rate of the loop; 2 is where Euler's and Heun's loops become unstable."""


def stable_gains(state: State, scale: FloatArray, step_s: float) -> FloatArray:
    """Return the gains K of the position and of the orientation error, as large as is safe, shape (2,), 1/s.

    A finger's pose error e obeys e' = -G^-T J W J^T G^T K e, W the inverse weights. How fast its parts fall
    goes with the square of the Jacobian's singular values, and these with lengths for positions but not for
    orientations: one gain for both would leave the position far behind. The two are balanced by the largest
    singular value of either part, and then scaled to the fastest rate of the loop as a whole, which leaves
    room for the Jacobian to change along a motion.

    Args:
        state: The system, evaluated where the motion starts.
        scale: 1 / sqrt(weight) of the variables, shape (n,).
        step_s: Control period.
    """
    system = state.system
    rows, contacts = system.rows, system.n_contacts
    linear = np.tile(system.arrays.twist_components < 3, contacts)
    jacobian = state.jacobian * scale
    stiffness = jacobian @ jacobian.T
    gains = np.array([1.0 / _largest(stiffness[np.ix_(part, part)]) for part in (linear, ~linear)])
    transposes = np.zeros_like(stiffness)
    for i in range(contacts):
        own = slice(rows * i, rows * (i + 1))
        transposes[own, own] = state.grasp_transpose(i)
    loop = np.linalg.solve(transposes, stiffness) @ transposes * np.where(linear, *gains)
    fastest = float(np.abs(np.linalg.eigvals(loop)).max())
    return np.asarray(gains * _STEP_TIMES_RATE / (step_s * fastest))


def _largest(symmetric: FloatArray) -> float:
    return max(float(np.linalg.eigvalsh(symmetric)[-1]), 1e-12) if len(symmetric) else 1.0
