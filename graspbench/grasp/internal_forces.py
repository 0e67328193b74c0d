"""Fingertip forces that hold an object: inside the friction cones, without moving it."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import nnls

from graspbench.arrays import FloatArray, cross

_EDGES = 16
_BALANCE, _CLOSE_BALANCE = 0.02, 0.005
"""Wrench that may be missing, over the total force: at all, and where friction is left to give up for it."""

_SHARES, _RESERVE_BISECTIONS = 256, 5
"""Steps of the share of friction that is left, and halvings where a coarse answer will do."""


def internal_forces(
    points: FloatArray,
    normals: FloatArray,
    friction: float,
    mean_normal_n: float,
    carried_n: FloatArray | None = None,
) -> tuple[FloatArray, float]:
    """Return forces that balance each other and leave every contact as much friction as can be.

    Args:
        points: Contacts from the object's centre of mass, shape (n, 3), m.
        normals: Unit normals pointing INTO the object, shape (n, 3).
        friction: Coulomb friction coefficient.
        mean_normal_n: Mean normal force of a contact.
        carried_n: What the forces add up to, at the centre of mass, shape (3,); None for nothing.

    Returns:
        As `ForceBalance.forces`.
    """
    return ForceBalance(points, normals, friction).forces(mean_normal_n, carried_n)


def friction_reserve(points: FloatArray, normals: FloatArray, friction: float, enough: float = 1.0) -> float:
    """Return the share of its friction that every contact keeps when the fingers squeeze as well as they can.

    It is 1 where the normals oppose each other exactly, 0 where all friction goes into balancing the fingers,
    and -1 where no forces balance. Contacts that keep little are lost by the weight, or by normals that are a
    little other than they were planned.

    Args:
        points: Contacts from the object's centre, shape (n, 3), m.
        normals: Unit normals pointing INTO the object, shape (n, 3).
        friction: Coulomb friction coefficient, positive.
        enough: Larger shares are returned as this one, which is quick to tell.
    """
    balance = ForceBalance(points, normals, friction)

    def missing(left: float) -> float:
        return balance.closest(left, np.zeros(3))[1]

    if missing(enough) <= _CLOSE_BALANCE:
        return enough
    if missing(0.0) > _BALANCE:
        return -1.0
    low, high = 0.0, enough
    for _ in range(_RESERVE_BISECTIONS):
        middle = 0.5 * (low + high)
        if missing(middle) <= _CLOSE_BALANCE:
            low = middle
        else:
            high = middle
    return low


class ForceBalance:
    """Forces at some contacts, inside their friction cones: laid out once, asked again and again.

    Args:
        points: Contacts from the object's centre of mass, shape (n, 3), m.
        normals: Unit normals pointing INTO the object, shape (n, 3).
        friction: Coulomb friction coefficient.
    """

    def __init__(self, points: FloatArray, normals: FloatArray, friction: float) -> None:
        n = len(points)
        edges = np.concatenate([cone_edges(normal, friction) for normal in normals])
        owner = np.repeat(np.arange(n), _EDGES)
        middle = points.mean(axis=0)
        arms = points - middle
        size = max(float(np.linalg.norm(arms, axis=1).max()), 1e-6)
        along = np.ones(len(edges))
        wrenches = np.vstack((edges.T, cross(arms[owner], edges).T / size))
        # Rows: no net wrench; the normal forces' sum; and, faintly, equal shares and small tangential forces.
        shares = np.stack([(owner == i) * along for i in range(n)])
        rows = np.vstack((wrenches, along[None], 1e-2 * (shares - along / n), 1e-3 * np.eye(len(edges))))
        self._system = rows / n
        self._edges = edges.reshape(n, _EDGES, 3)
        self._normals, self._arms, self._middle, self._size = normals, arms, middle, size
        # A force in the cone shifted along its normal has so much left; the shift is there in any case.
        self._of_shift = np.concatenate((normals.sum(axis=0), cross(arms, normals).sum(axis=0) / size))

    def forces(
        self, mean_normal_n: float, carried_n: FloatArray | None = None, near: float | None = None
    ) -> tuple[FloatArray, float]:
        """Return forces that balance each other and leave every contact as much friction as can be.

        What a contact has left is the further tangential force that it takes before it slides: the friction
        coefficient times its normal force, less its tangential force. The smallest one of all contacts is
        made as large as the balance allows, since the weight and disturbances come upon each of them.

        Args:
            mean_normal_n: Mean normal force of a contact.
            carried_n: What the forces add up to, at the centre of mass, shape (3,); None for nothing.
            near: What was left of a similar load: the answer is the same, and found sooner.

        Returns:
            Forces on the object, shape (n, 3), and what is left at the contact that has least, as share of
            the friction times the mean normal force: 1 where all forces run along their normals. It is -1
            when the full cones allow no balance, and the forces are then the closest to it.
        """
        carried = np.zeros(3) if carried_n is None else carried_n / mean_normal_n
        found: dict[int, tuple[FloatArray, float]] = {}

        def missing(share: int) -> float:
            if share not in found:
                found[share] = self.closest(share / _SHARES, carried)
            return found[share][1]

        if (near is None or near <= 0.0) and missing(0) > _BALANCE:
            return mean_normal_n * found[0][0], -1.0
        begin = 0 if near is None else round(near * _SHARES)
        share = _largest(lambda share: missing(share) <= _CLOSE_BALANCE, _SHARES, begin)
        left = share / _SHARES if missing(share) <= _BALANCE else -1.0
        return mean_normal_n * found[share][0], left

    def closest(self, left: float, carried: FloatArray) -> tuple[FloatArray, float]:
        """Minimise the resulting wrench of forces that leave each contact some friction.

        Args:
            left: What each contact has left, as share of the friction times the mean normal force.
            carried: What the forces add up to, per mean normal force, shape (3,).

        Returns:
            Forces of mean normal part 1, shape (n, 3), and the wrench that is missing per total force.
        """
        n = len(self._normals)
        aim = np.concatenate((carried, -cross(self._middle, carried) / self._size))
        wanted = np.zeros(len(self._system))
        wanted[:6] = (aim - left * self._of_shift) / n
        wanted[6] = 1.0 - left
        weights, _ = nnls(self._system, wanted)
        shares = weights.reshape(n, _EDGES)
        forces = np.stack([shares[i] @ self._edges[i] for i in range(n)]) + left * self._normals
        total = float(np.einsum("ij,ij->", forces, self._normals))
        turning = cross(self._arms, forces).sum(axis=0) / self._size
        missing = np.concatenate((forces.sum(axis=0), turning)) - aim
        if not carried.any():
            forces *= n / max(total, 1e-9)
        return forces, float(np.linalg.norm(missing)) / max(total, 1e-9)


def _largest(holds: Callable[[int], bool], end: int, near: int) -> int:
    """Return the largest whole number below ``end`` for which something holds; 0 where there is none.

    What holds for one holds for all smaller ones. The search goes from ``near`` in steps that double, then
    halves what is left.
    """
    low, high, step = 0, end, 1
    at = min(near, end - 1)
    while low < at < high:
        if holds(at):
            low, at = at, at + step
        else:
            high, at = at, at - step
        step *= 2
    while high - low > 1:
        middle = (low + high) // 2
        if holds(middle):
            low = middle
        else:
            high = middle
    return low


def cone_edges(normal: FloatArray, friction: float) -> FloatArray:
    """Return the edges of a friction cone with unit normal part, shape (edges, 3)."""
    u = cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    u /= np.linalg.norm(u)
    v = cross(normal, u)
    angles = 2 * np.pi * np.arange(_EDGES) / _EDGES
    edges: FloatArray = normal + friction * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v)
    return edges
