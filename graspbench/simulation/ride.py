"""Where the frame in which a grasp was planned has got to, as far as the hand knows it."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.geometry.planar_motion import PlanarMotion


class Ride:
    """The object's estimated motion, which the hand follows until it has lifted the object.

    All of a grasp is planned where the object was at the motion's reference time. What is driven is carried
    along by the estimate; so the wrist's motors get its twist as feed-forward. After the lift the hand comes
    to rest smoothly.

    Args:
        motion: The object's motion.
        start_s: The motion's time when the execution begins.
    """

    def __init__(self, motion: PlanarMotion, start_s: float) -> None:
        self._motion, self._start_s = motion, start_s
        self._halt_s, self._over_s = np.inf, 1.0

    def halt(self, time_s: float, over_s: float) -> None:
        """Come to rest within a time from then on."""
        self._halt_s, self._over_s = time_s, over_s

    def displacements(self, times_s: FloatArray) -> FloatArray:
        """Return the transforms from where things are planned to where they are, shape (n, 4, 4).

        Args:
            times_s: Since the execution began, shape (n,).
        """
        times = np.asarray(times_s, dtype=np.float64)
        if np.isfinite(self._halt_s):
            share = np.clip((times - self._halt_s) / self._over_s, 0.0, 1.0)
            # The speed fades as a fifth-order step from 1 to 0 does; this is its integral.
            gone = share - share**4 * (2.5 - share * (3.0 - share))
            times = np.minimum(times, self._halt_s) + self._over_s * gone
        return self._motion.displacements(self._start_s + times)

    def displacement(self, time_s: float) -> FloatArray:
        """Return the transform of `displacements` for one time, shape (4, 4)."""
        moved: FloatArray = self.displacements(np.array([time_s]))[0]
        return moved
