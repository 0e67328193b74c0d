"""What a hand can lift with a grasp, as far as its joints' efforts and the contacts' friction allow."""

import numpy as np
from scipy.optimize import linprog

from graspbench.arrays import FloatArray
from graspbench.grasp.internal_forces import cone_edges
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture


def payload_n(
    hand: HandModel,
    posture: HandPosture,
    points: FloatArray,
    normals: FloatArray,
    centre: FloatArray,
    friction: float,
    torsion_m: float = 0.0,
) -> float:
    """Return the largest weight (N) that fingertip forces carry, inside their cones and the joints' limits.

    The fingers' own weight counts as nothing, so it is an upper bound of what an execution can lift: no force
    control carries more with these contacts. Between two contacts the object may swing about the line through
    them: no moment about that line is asked for.

    Args:
        hand: The hand.
        posture: How it holds the contacts.
        points: Contacts in the world, shape (n, 3), m.
        normals: Unit normals pointing INTO the object, shape (n, 3).
        centre: The object's centre of mass, shape (3,), m.
        friction: Coulomb friction coefficient.
        torsion_m: Largest moment about a contact's normal per unit of its normal force; 0 for hard fingers.
    """
    rotation = posture.transform_palm_to_world[:3, :3]
    jacobians = hand.tip_jacobians(posture.joints)
    turns = _held_turns(points)
    wrenches, torques = [], []
    for point, normal, finger in zip(points, normals, posture.fingers, strict=True):
        edges = cone_edges(normal, friction)
        twist = torsion_m * np.outer(edges @ normal, normal)
        for sign in (-1.0, 1.0):
            moments = np.cross(point - centre, edges) + sign * twist
            wrenches.append(np.hstack((edges, moments @ turns / _LENGTH_M)))
            torques.append(edges @ rotation @ jacobians[finger])
    balance = np.column_stack((np.concatenate(wrenches).T, [0.0, 0.0, -1.0, *np.zeros(turns.shape[1])]))
    efforts = np.column_stack((np.concatenate(torques).T, np.zeros(hand.n_joints)))
    limits = hand.effort_limits
    found = linprog(
        np.append(np.zeros(balance.shape[1] - 1), -1.0),
        A_ub=np.vstack((efforts, -efforts)),
        b_ub=np.concatenate((limits, limits)),
        A_eq=balance,
        b_eq=np.zeros(len(balance)),
    )
    return 0.0 if found.status != 0 or found.fun is None else float(-found.fun)


def _held_turns(points: FloatArray) -> FloatArray:
    """Return the axes about which contacts have to hold an object, in columns."""
    if len(points) != 2:
        return np.eye(3)
    line = points[1] - points[0]
    across = np.cross(line, np.eye(3)[int(np.argmin(np.abs(line)))])
    axes = np.column_stack((across, np.cross(line, across)))
    return np.asarray(axes / np.linalg.norm(axes, axis=0))


_LENGTH_M = 0.1
"""Moments are weighed against forces by it; any length gives the same answer."""
