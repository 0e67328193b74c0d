"""What a hand can lift with a grasp, as far as its joints' efforts and the contacts' friction allow."""

import numpy as np
from scipy.optimize import linprog, nnls

from graspbench.arrays import FloatArray, cross
from graspbench.grasp.internal_forces import cone_edges
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture
from graspbench.hand.touching import touching


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
    return _most(*_lay_out(hand, posture, points, normals, centre, friction, torsion_m), hand.effort_limits)


def carries(
    hand: HandModel,
    posture: HandPosture,
    points: FloatArray,
    normals: FloatArray,
    centre: FloatArray,
    friction: float,
    torsion_m: float,
    weight_n: float,
) -> bool:
    """Tell whether `payload_n` is at least a weight (N); where it is, that is found much sooner."""
    wrenches, torques = _lay_out(hand, posture, points, normals, centre, friction, torsion_m)
    limits = hand.effort_limits
    return _balance_found(wrenches, torques, limits, weight_n) or _most(wrenches, torques, limits) >= weight_n


def _lay_out(
    hand: HandModel,
    posture: HandPosture,
    points: FloatArray,
    normals: FloatArray,
    centre: FloatArray,
    friction: float,
    torsion_m: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the wrench and the joint torques of a unit force along each edge of the cones, in columns."""
    rotation = posture.transform_palm_to_world[:3, :3]
    jacobians = touching(hand, posture, -normals).tip_jacobians(posture.joints)
    turns = _held_turns(points)
    wrenches, torques = [], []
    for point, normal, finger in zip(points, normals, posture.fingers, strict=True):
        edges = cone_edges(normal, friction)
        twist = torsion_m * np.outer(edges @ normal, normal)
        for sign in (-1.0, 1.0) if torsion_m else (1.0,):
            moments = cross(point - centre, edges) + sign * twist
            wrenches.append(np.hstack((edges, moments @ turns / _LENGTH_M)))
            torques.append(edges @ rotation @ jacobians[finger])
    return np.concatenate(wrenches).T, np.concatenate(torques).T


def _most(wrenches: FloatArray, torques: FloatArray, limits: FloatArray) -> float:
    """Return the largest weight that the edges' forces carry, by a linear program."""
    weight = np.zeros((len(wrenches), 1))
    weight[2] = -1.0
    efforts = np.hstack((torques, np.zeros((len(torques), 1))))
    found = linprog(
        np.append(np.zeros(wrenches.shape[1]), -1.0),
        A_ub=np.vstack((efforts, -efforts)),
        b_ub=np.concatenate((limits, limits)),
        A_eq=np.hstack((wrenches, weight)),
        b_eq=np.zeros(len(wrenches)),
    )
    return 0.0 if found.status != 0 or found.fun is None else float(-found.fun)


def _balance_found(wrenches: FloatArray, torques: FloatArray, limits: FloatArray, weight_n: float) -> bool:
    """Tell whether some forces were found that carry a weight; False says nothing.

    They are sought as what misses least of balance and limits, the torques' distances from both limits being
    unknowns as well; what is found is then checked.
    """
    if weight_n <= 0.0 or limits.min() <= 0.0:
        return False
    joints, edges = torques.shape
    shares = torques * (weight_n / limits[:, None])
    system = np.zeros((len(wrenches) + 2 * joints, edges + 2 * joints))
    system[: len(wrenches), :edges] = wrenches
    system[len(wrenches) :, :edges] = np.vstack((shares, -shares))
    system[len(wrenches) :, edges:] = np.eye(2 * joints)
    wanted = np.zeros(len(system))
    wanted[2], wanted[len(wrenches) :] = 1.0, 1.0
    forces = nnls(system, wanted)[0][:edges]
    missing = np.abs(wrenches @ forces - wanted[: len(wrenches)]).max()
    return bool(missing <= _ROUNDING and np.abs(shares @ forces).max() <= 1.0 + _ROUNDING)


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

_ROUNDING = 1e-9
"""What forces may miss of a balance, as share of the weight, and exceed of a limit."""
