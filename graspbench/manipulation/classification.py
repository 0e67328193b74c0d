"""What kind of grasp it is: redundant, indeterminate, its degrees of freedom (thesis 4.3)."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.manipulation.contact_kinematics import State, contact_columns

RANK_TOLERANCE = 1e-9
"""Singular values below this share of the largest one count as zero."""


@dataclass(frozen=True, eq=False)
class GraspClass:
    """The kinematic class of a grasp.

    Attributes:
        variables: Number of joint and contact variables.
        closed_chain_constraints: Independent constraints that the object's closed chains put on them.
        degrees_of_freedom: What is left: independent motions of hand and object together.
        redundant: Whether variables can move while the object is locked.
        redundant_fingers: Whether an extended finger taken alone has such motions, shape (n_c,).
        internal_motions: Basis of them for the whole hand, rows z', shape (k, n_variables).
        indeterminate: Whether the object can move while all joints are locked.
        object_motions: Basis of those motions, rows of object twists, shape (m, 6).
        contact_motions: The variables' rates that go with them, shape (m, n_variables).
        controllable: Whether the joints can impose every motion of the object.
    """

    variables: int
    closed_chain_constraints: int
    degrees_of_freedom: int
    redundant: bool
    redundant_fingers: tuple[bool, ...]
    internal_motions: FloatArray
    indeterminate: bool
    object_motions: FloatArray
    contact_motions: FloatArray
    controllable: bool


def classify(state: State) -> GraspClass:
    """Classify the grasp at its configuration.

    A finger's motions with the object locked are the null space of Jt_i = [J_i, J_eta_i]. For fingers that
    share joints the stacked Jt decides, because a shared joint cannot serve one finger only. The
    object's motions with the joints locked are the object parts of the null space of all
    [-J_eta_i, G_i^T] together.

    Args:
        state: The system, evaluated.
    """
    system = state.system
    n, n_q, rows = system.n_variables, system.n_joints, system.rows
    jacobian = state.jacobian
    transposes = np.vstack([state.grasp_transpose(i) for i in range(system.n_contacts)])

    internal = null_space(jacobian)
    everything = null_space(np.hstack([jacobian, -transposes]))
    locked = null_space(np.hstack([jacobian[:, n_q:], -transposes]))
    # Motions of the variables that keep all chains closed, whatever the object does.
    closed_rank = int(np.linalg.matrix_rank(everything[:, :n], tol=RANK_TOLERANCE)) if len(everything) else 0
    motions = np.zeros((len(locked), 6))
    motions[:, system.arrays.twist_components] = locked[:, n - n_q :]
    contact_motions = np.hstack([np.zeros((len(locked), n_q)), locked[:, : n - n_q]])
    fingers = []
    for i in range(system.n_contacts):
        block = jacobian[rows * i : rows * (i + 1)]
        own = np.flatnonzero(system.arrays.paths[i])
        extended = block[:, np.concatenate([own, contact_columns(system, i)])]
        fingers.append(len(null_space(extended)) > 0)
    object_rank = int(np.linalg.matrix_rank(everything[:, n:], tol=RANK_TOLERANCE)) if len(everything) else 0
    return GraspClass(
        variables=n,
        closed_chain_constraints=n - closed_rank,
        degrees_of_freedom=len(everything),
        redundant=len(internal) > 0,
        redundant_fingers=tuple(fingers),
        internal_motions=internal,
        indeterminate=len(locked) > 0,
        object_motions=motions,
        contact_motions=contact_motions,
        controllable=object_rank == rows,
    )


def null_space(matrix: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the null space, one motion a row, shape (k, n)."""
    _, values, right = np.linalg.svd(matrix)
    rank = int(np.sum(values > RANK_TOLERANCE * max(values.max(initial=0.0), 1.0)))
    return np.asarray(right[rank:], dtype=np.float64)
