"""A body that is led to where a mass on a spring and a damper would be (model reference control)."""

from typing import Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.controllers.second_order import SecondOrder


class ReferenceOscillator:
    """Runs an oscillator beside a body and accelerates the body with it and back to it.

    A force is felt a step late and a disturbance is made up for in time; the body keeps what it missed till
    then, since the oscillator's own law only knows where the body is. The reference takes the felt forces at
    the steps in which they acted, and the body's distance from it dies out critically damped.

    Args:
        oscillator: What the body shall be.
        bandwidth_rad_s: How fast the distance dies out.
        time_step_s: Time step.
    """

    def __init__(self, oscillator: SecondOrder, bandwidth_rad_s: float, time_step_s: float) -> None:
        self._oscillator, self._dt = oscillator, time_step_s
        self._following = SecondOrder(1.0, 2.0 * bandwidth_rad_s, bandwidth_rad_s**2, time_step_s)
        self._state: tuple[FloatArray, FloatArray, FloatArray] | None = None
        self._displaced = np.zeros(1)

    def acceleration(self, offset: FloatArray, rate: FloatArray, force: FloatArray) -> FloatArray:
        """Return the acceleration for the next step, shape (n,); the reference begins where the body is.

        Args:
            offset: Of the body from where the spring is relaxed, shape (n,).
            rate: How fast it moved in the step before, without what is taken back otherwise, shape (n,).
            force: That acted on it in the step before, and is taken to last, shape (n,).
        """
        oscillator, dt = self._oscillator, self._dt
        away, speed, last = self._state or (offset - self._displaced, rate, force)
        jump = np.zeros_like(rate)
        if self._state is not None:
            jump = -oscillator.rate_at_rest(oscillator.relaxed(force - last))
            speed = speed + jump
            speed = speed + dt * oscillator.acceleration(away, speed, force)
            away = away + dt * speed
        change = oscillator.rate_at_rest(self._displaced)
        away, speed, jump = away + self._displaced, speed + change, jump + change
        self._state, self._displaced = (away, speed, force), np.zeros_like(rate)
        # What a jump changed of the reference's speed the body takes over at once.
        back = self._following.acceleration(offset - away, rate + jump - speed, np.zeros_like(force))
        return oscillator.acceleration(away, speed, force) + jump / dt + back

    def displace(self, offset: FloatArray) -> None:
        """Let the reference jump in the next step, as the body's offset does with its goal, shape (n,)."""
        self._displaced = self._displaced + offset

    def memory(self) -> Any:
        """Return what `recall` takes."""
        return self._state, self._displaced

    def recall(self, memory: Any) -> None:
        """Return to a time before."""
        self._state, self._displaced = memory
