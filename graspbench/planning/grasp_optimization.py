"""Bayesian optimisation of a grasp measure over candidates, of which few can be tried.

What a measure will turn out to be at a candidate is foreseen from the surface as it was seen, with an error
that is a Gaussian process over the contacts: grasps whose contacts lie near each other err alike. A trial
tells the measure's value at one candidate and something of its neighbours. The next to be tried is the one
with the largest expected improvement on the best value felt so far (Mockus 1975; Jones, Schonlau and Welch
1998).
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import ndtr  # all of scipy.stats takes longer to load than a trial's first stages

from graspbench.arrays import FloatArray


class Choice(NamedTuple):
    """A candidate to be tried next.

    Attributes:
        number: Which one.
        improvement: By how much it is expected to be better than the best so far, in the measure's unit.
    """

    number: int
    improvement: float


class GraspOptimization:
    """What is believed of each candidate's measure.

    Args:
        contacts: Contacts of each candidate, in the same order of fingers, shape (m, n, 3), m.
        foreseen: The measure as the surface foretells it, shape (m,).
        deviation: Standard deviation of what is felt from that.
        noise: The part of it that the neighbours do not share.
        length_m: Root mean square distance of two grasps' contacts over which errors are alike.

    Attributes:
        felt: Values felt so far, by candidate.
    """

    def __init__(
        self, contacts: FloatArray, foreseen: FloatArray, deviation: float, noise: float, length_m: float
    ) -> None:
        self._foreseen = np.asarray(foreseen, dtype=np.float64)
        self._noise = noise
        apart = contacts[:, None] - contacts[None]
        squares = np.square(apart).sum(axis=-1).mean(axis=-1)
        self._covariance: FloatArray = deviation**2 * np.exp(-0.5 * squares / length_m**2)
        self.felt: dict[int, float] = {}

    def tell(self, number: int, value: float) -> None:
        """Take note of the value that a trial of a candidate gave."""
        self.felt[number] = value

    def believed(self) -> tuple[FloatArray, FloatArray]:
        """Return mean and standard deviation of the value that a trial of each candidate would give, (m,)."""
        variance = np.diag(self._covariance) + self._noise**2
        if not self.felt:
            return self._foreseen.copy(), np.sqrt(variance)
        tried = list(self.felt)
        among = self._covariance[np.ix_(tried, tried)] + self._noise**2 * np.eye(len(tried))
        factor, across = cho_factor(among), self._covariance[:, tried]
        errors = np.array(list(self.felt.values())) - self._foreseen[tried]
        mean = self._foreseen + across @ cho_solve(factor, errors)
        known = np.einsum("ij,ji->i", across, cho_solve(factor, across.T))
        return mean, np.sqrt(np.maximum(variance - known, 0.0))

    def choose(self) -> Choice | None:
        """Return the untried candidate with the largest expected improvement; None when all are tried."""
        left = [k for k in range(len(self._foreseen)) if k not in self.felt]
        if not left:
            return None
        mean, deviation = self.believed()
        best = max(self.felt.values(), default=0.0)
        ahead, spread = mean[left] - best, np.maximum(deviation[left], 1e-300)
        z = ahead / spread
        expected = ahead * ndtr(z) + spread * np.exp(-(z**2) / 2.0) / np.sqrt(2.0 * np.pi)
        k = int(np.argmax(expected))
        return Choice(left[k], float(expected[k]))
