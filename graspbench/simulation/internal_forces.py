"""Fingertip forces that hold an object: inside the friction cones, without moving it."""

import numpy as np
from scipy.optimize import nnls

from graspbench.arrays import FloatArray

_EDGES = 12
_BALANCE = 0.02
# Least normal force of a contact as shares of the mean, in the order of preference: a finger that hardly
# presses is soon lost.
_FLOORS = (0.4, 0.2, 0.1, 0.0)


def internal_forces(
    points: FloatArray, normals: FloatArray, friction: float, mean_normal_n: float
) -> tuple[FloatArray, float]:
    """Return forces that balance each other, as deep inside the friction cones as can be.

    The smallest share of the friction that still allows balance is looked for; what is left of the cones
    is there for the weight and for disturbances.

    Args:
        points: Contacts, shape (n, 3), m.
        normals: Unit normals pointing INTO the object, shape (n, 3).
        friction: Coulomb friction coefficient.
        mean_normal_n: Mean normal force of a contact.

    Returns:
        Forces on the object, shape (n, 3), and the share of friction they use, 0 to 1; the share is
        infinite when the full cones allow no balance, and the forces are then the closest to it.
    """
    for floor in _FLOORS:
        forces, balance = _balanced(points, normals, friction, mean_normal_n, floor)
        if balance <= _BALANCE:
            break
    else:
        return forces, np.inf
    low, high = 0.0, 1.0
    for _ in range(7):
        middle = 0.5 * (low + high)
        trial, balance = _balanced(points, normals, middle * friction, mean_normal_n, floor)
        if balance <= _BALANCE:
            high, forces = middle, trial
        else:
            low = middle
    return forces, high


def _balanced(
    points: FloatArray, normals: FloatArray, friction: float, mean_normal_n: float, floor: float
) -> tuple[FloatArray, float]:
    """Minimise the resulting wrench of cone forces; return them and the wrench per total force."""
    n = len(points)
    edges = np.concatenate([_cone(normal, friction) for normal in normals])
    owner = np.repeat(np.arange(n), _EDGES)
    arms = points - points.mean(axis=0)
    size = max(float(np.linalg.norm(arms, axis=1).max()), 1e-6)
    wrenches = np.vstack((edges.T, np.cross(arms[owner], edges).T / size))
    along = np.einsum("ij,ij->i", edges, normals[owner])
    # Rows: no net wrench; the normal forces' sum; and, faintly, equal shares and small tangential forces.
    shares = np.stack([(owner == i) * along for i in range(n)])
    system = np.vstack((wrenches, along[None], 1e-2 * (shares - along / n), 1e-3 * np.eye(len(edges))))
    wanted = np.zeros(len(system))
    wanted[6] = 1.0
    weights, _ = nnls(system, wanted)
    held: list[int] = []
    while weak := [i for i in range(n) if i not in held and shares[i] @ weights < floor / n - 1e-9]:
        held += weak  # contacts below the floor are put on it
        rows = np.vstack((system, shares[held]))
        weights, _ = nnls(rows, np.concatenate((wanted, np.full(len(held), floor / n))))
    total = float(along @ weights)
    imbalance = float(np.linalg.norm(wrenches @ weights)) / max(total, 1e-9)
    forces = np.stack([weights[owner == i] @ edges[owner == i] for i in range(n)])
    return forces * (n * mean_normal_n / max(total, 1e-9)), imbalance


def _cone(normal: FloatArray, friction: float) -> FloatArray:
    """Return the edges of a friction cone with unit normal part, shape (edges, 3)."""
    u = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    angles = 2 * np.pi * np.arange(_EDGES) / _EDGES
    edges: FloatArray = normal + friction * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v)
    return edges
