"""Contact forces along a motion, computed at a lower rate while it runs."""

from collections.abc import Mapping, Sequence

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.grasp.sliding_friction import Sliding
from graspbench.manipulation.clik import Clik
from graspbench.manipulation.contact_kinematics import ManipulationSystem
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.forces import ForceDistribution
from graspbench.manipulation.held_object import HeldObject
from graspbench.manipulation.motion import Trajectory
from graspbench.manipulation.pad_compliance import PadCompliance
from graspbench.manipulation.sliding.slide import sliding_contacts, slips
from graspbench.manipulation.sliding.sliding_history import SlidingHistory


class ForceRecorder:
    """Computes contact forces at a lower rate while the motion runs; soft pads give way to them.

    With contacts that slide on purpose, a motion ends where no forces balance the load.
    """

    def __init__(
        self,
        parameters: ContactParameters,
        trajectory: Trajectory,
        to_world: FloatArray,
        step_s: float,
        gravity: float,
        system: ManipulationSystem,
    ) -> None:
        self.times: list[float] = []
        self.forces: list[FloatArray] = []
        self.torsions: list[FloatArray] = []
        self.margins: list[float] = []
        self._every = max(round(1.0 / (parameters.force_rate_hz * step_s)), 1)
        self._step_s, self._trajectory = step_s, trajectory
        self._mass = parameters.carried_kg
        self._gravity = gravity * to_world.T @ np.array([0.0, 0.0, 1.0])
        self._slides = any(contact.slides for contact in system.contacts)
        self._wrench = np.array(parameters.sliding.wrench) if self._slides else np.zeros(6)
        self._fingers = parameters.sliding.fingers
        self._reserve = parameters.sliding.friction_reserve if self._slides else 0.0
        self._distribute = ForceDistribution(parameters.forces, self._reserve)
        self._along: list[FloatArray] = []
        self._spins: list[FloatArray] = []
        self._each: list[FloatArray] = []
        self.pads = PadCompliance(system, parameters.forces.pad) if parameters.kind == "soft_pad" else None
        self.deflections: list[FloatArray] = []

    def settled(self, held: HeldObject) -> HeldObject:
        """Return the start with its pads loaded, if there are any and forces balance the weight."""
        if self.pads is None:
            return held
        try:
            found = self._distribute(held.system.state(held.joints, held.variables), self._load(0.0))
        except ManipulationError:
            return held
        return self.pads.settled(held, found)

    def watch(self, clik: Clik, period: int) -> None:
        """Record the forces of a period, if they are due, and let the pads give way until the next one."""
        if self.pads is not None:
            self.deflections.append(self.pads.deflections)
        if period % self._every == 0:
            self._record(clik, period * self._step_s)
        if self.pads is not None:
            self.pads.pass_time((period % self._every + 1) / self._every)

    def sliding(self, fingers: tuple[int, ...], contacts: tuple[int, ...]) -> SlidingHistory | None:
        """Return how the tips slid, None if none of them was to.

        Args:
            fingers: Finger of the hand at each contact.
            contacts: Those that slide.
        """
        if not self._slides:
            return None
        arrays = np.array(self._along), np.array(self._spins), np.array(self._each)
        return SlidingHistory(fingers, contacts, *arrays)

    def _record(self, clik: Clik, time_s: float) -> None:
        self.times.append(time_s)
        sliding = None
        if self._slides:
            along, spins = slips(clik)
            sliding = sliding_contacts(clik.state, along, spins)
            self._along.append(along)
            self._spins.append(spins)
        try:
            found = self._distribute(clik.state, self._load(time_s), sliding)
        except ManipulationError:
            if self._slides:
                raise ManipulationError(
                    f"no contact forces balance the load while {_named(self._fingers, sliding)} and every "
                    f"other contact keeps {100.0 * self._reserve:g} % of its friction"
                ) from None
            self.forces.append(np.full((clik.system.n_contacts, 3), np.nan))
            self.torsions.append(np.full(clik.system.n_contacts, np.nan))
            self.margins.append(float("nan"))
            return
        self.forces.append(found.forces)
        self.torsions.append(found.torsions)
        self.margins.append(found.smallest_margin)
        self._each.append(found.margins)
        if self.pads is not None:
            self.pads.load(clik.state, found)

    def _load(self, time_s: float) -> FloatArray:
        """Return the wrench that the fingers have to apply to the object, shape (6,)."""
        load = self._wrench.copy()
        # a point mass: the torque of a small object's angular acceleration is negligible here
        load[:3] += self._mass * (self._trajectory(time_s).acceleration[:3] + self._gravity)
        return load


def _named(fingers: Sequence[int], sliding: Mapping[int, Sliding] | None) -> str:
    if not sliding:
        return "all contacts are at rest"
    numbers = ", ".join(map(str, fingers))
    return f"finger {numbers} slides" if len(fingers) == 1 else f"fingers {numbers} slide"
