"""Whether some contacts hold the object while a finger is off it."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.internal_forces import friction_reserve


class HoldTest:
    """Tells which sets of contacts squeeze the object with friction to spare; what is asked twice is kept.

    Args:
        friction: Coulomb friction coefficient.
        reserve: Share of its friction that every contact has to keep.
    """

    def __init__(self, friction: float, reserve: float) -> None:
        self._friction, self._enough = friction, max(reserve, 1e-3)
        self._known: dict[bytes, bool] = {}

    def __call__(self, points: FloatArray, normals: FloatArray) -> bool:
        """Return whether contacts hold; two or more of them, normals outwards, shape (n, 3) each."""
        if len(points) < 2 or self._friction == 0.0:
            return False
        key = points.tobytes() + normals.tobytes()
        if key not in self._known:
            middle = points.mean(axis=0)
            found = friction_reserve(points - middle, -normals, self._friction, self._enough)
            self._known[key] = found >= self._enough
        return self._known[key]

    def without(self, points: FloatArray, normals: FloatArray, finger: int) -> bool:
        """Return whether all contacts but one hold."""
        return self(np.delete(points, finger, axis=0), np.delete(normals, finger, axis=0))
