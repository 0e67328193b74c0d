"""A mass, a spring and a damper whose steps are exact whatever the time step."""

import cmath
import math

import numpy as np

from graspbench.arrays import FloatArray


class SecondOrder:
    """Acceleration that makes a body follow m x'' + d x' + k x = f, sampled without an error.

    A simulation advances v by a dt, then x by the new v dt. With the acceleration of the continuous law the
    response would lag behind by half a step, as if the damper were weaker by k dt / 2. The exact solution
    obeys x[k + 1] = trace(A) x[k] - det(A) x[k - 1] with A the transition matrix of one step (Franklin,
    Powell and Workman 1998), so that this acceleration lands on it.

    Args:
        mass: Kg or kg m^2.
        damping: N s/m or N m s/rad.
        stiffness: N/m or N m/rad.
        time_step_s: Time step.
    """

    def __init__(self, mass: float, damping: float, stiffness: float, time_step_s: float) -> None:
        self._dt, self._stiffness = time_step_s, stiffness
        discriminant = cmath.sqrt(damping * damping - 4.0 * mass * stiffness)
        slow, fast = ((-damping + sign * discriminant) / (2.0 * mass) for sign in (1.0, -1.0))
        self._trace = (cmath.exp(slow * time_step_s) + cmath.exp(fast * time_step_s)).real
        self._determinant = math.exp(-damping / mass * time_step_s)
        first = 1.0 - step_response(np.array([time_step_s]), mass, damping, stiffness)[0]
        self._rest_rate = float(1.0 - (self._trace - first) / self._determinant) / time_step_s

    def acceleration(self, offset: FloatArray, rate: FloatArray, force: FloatArray) -> FloatArray:
        """Return the acceleration for the next step, shape (n,).

        Args:
            offset: Of the body from where the spring is relaxed, shape (n,).
            rate: How fast it moved in the step before, shape (n,).
            force: On the body, shape (n,).
        """
        away = offset - self.relaxed(force)
        following = self._trace * away - self._determinant * (away - self._dt * rate)
        acceleration: FloatArray = (following - away - self._dt * rate) / self._dt**2
        return acceleration

    def rate_at_rest(self, offset: FloatArray) -> FloatArray:
        """Return the rate in the step before of a body that now stands still at an offset, shape (n,).

        The exact solution goes on backwards from there; a body that did not move before is half a step ahead.
        """
        return self._rest_rate * offset

    def relaxed(self, force: FloatArray) -> FloatArray:
        """Return the offset at which the spring bears a force, shape (n,)."""
        return force / self._stiffness


def step_response(times_s: FloatArray, mass: float, damping: float, stiffness: float) -> FloatArray:
    """Return x(t) of m x'' + d x' + k x = k from rest at 0: the closed form, shape of ``times_s``."""
    root = cmath.sqrt(damping * damping - 4.0 * mass * stiffness)
    if abs(root) < 1e-9 * damping:
        rate = damping / (2.0 * mass)
        return np.asarray(1.0 - (1.0 + rate * times_s) * np.exp(-rate * times_s))
    first, second = (-damping + root) / (2.0 * mass), (-damping - root) / (2.0 * mass)
    decays = (second * np.exp(first * times_s) - first * np.exp(second * times_s)) / (second - first)
    return np.asarray(1.0 - decays.real)
