"""A grip that becomes firmer when the object is felt to slide."""

from graspbench.simulation.force_control import ForceControl

_FELT_M = 1e-4


class SlipResponse:
    """Raises the grip force by a share each time a contact has slid a tenth of a millimetre farther.

    Args:
        control: The fingers' force control.
        share: Growth of the grip force, 0 for none.
        limit_n: Largest mean normal force of a finger that it is raised to, N.
    """

    def __init__(self, control: ForceControl, share: float, limit_n: float) -> None:
        self._control, self._share, self._limit_n = control, share, limit_n
        self._known_m = 0.0

    def feel(self, slip_m: float) -> None:
        """Respond to the net sliding since the squeeze at the contact that slid farthest."""
        if self._share == 0.0 or slip_m < self._known_m + _FELT_M:
            return
        self._known_m = slip_m
        firmer = min((1.0 + self._share) * self._control.mean_force_n, self._limit_n)
        if firmer > self._control.mean_force_n:
            self._control.mean_force_n = firmer
            self._control.distribute()
