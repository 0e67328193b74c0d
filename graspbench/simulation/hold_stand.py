"""A stand that tries grasps: a hand on a floating wrist, one object in it, forces and motions on demand.

The palm at the grasp is the origin of the stand, so that hand and object are loaded once for all grasps of a
set. There is no gravity; where a trial wants weight, it is a force on the object alone, since fingers have
motors that carry them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand.hand_pose import HandPose
from graspbench.hand.model import HandModel
from graspbench.simulation.slip import SlipMeter
from graspbench.simulation.stage import turn_deg
from graspbench.simulation.stand_parameters import StandParameters
from graspbench.simulation.stand_physics import StandPhysics
from graspbench.simulation.straight_motion import Goes, between

if TYPE_CHECKING:
    from graspbench.geometry.model import ObjectModel

GRAVITY_M_S2 = 9.81
_CONTACT_FORCE_N = 0.05
_LOOK_S = 0.01
_REST_S, _REST_M, _REST_DEG = 0.15, 1e-4, 0.1


@dataclass(frozen=True)
class Drift:
    """How far an object has come from where it was held.

    Attributes:
        moved_m: Way of its centre in the palm frame.
        turned_deg: Its rotation in the palm frame.
        slip_m: Net sliding at the contact that slid farthest.
        fingers: Fingers that touch it.
    """

    moved_m: float
    turned_deg: float
    slip_m: float
    fingers: int


class HoldStand:
    """A hand and an object, for one grasp after the other; use it as a context manager.

    Args:
        hand: The hand.
        object_model: The object.
        parameters: The physics.

    Raises:
        HandError: PyBullet cannot load the hand.
        SimulationError: PyBullet cannot build the object.
    """

    def __init__(
        self, hand: HandModel, object_model: "ObjectModel", parameters: StandParameters | None = None
    ) -> None:
        self.hand, self.object_model = hand, object_model
        self.parameters = StandParameters() if parameters is None else parameters
        self._physics = StandPhysics(hand, object_model, self.parameters)
        self._start, self._palm, self._squeezed = np.eye(4), np.eye(4), hand.rest
        self._slip: SlipMeter | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the world; closing twice does no harm."""
        self._physics.close()

    @property
    def weight_n(self) -> float:
        """The object's weight in the present trial."""
        return self._physics.mass_kg * GRAVITY_M_S2

    def grasp(
        self,
        stages: Sequence[HandPose],
        mass_kg: float,
        friction: float,
        *,
        transform_error: FloatArray | None = None,
        meter_slip: bool = True,
    ) -> Drift:
        """Let the hand close from the first stage by the others, and remember the state for `restore`.

        The object floats without weight.

        Args:
            stages: Open, touching, squeezed.
            mass_kg: The object's mass.
            friction: Coulomb friction between hand and object.
            transform_error: How the object is displaced in its own frame, shape (4, 4); None: not at all.
            meter_slip: Whether sliding is added up in the trials; it costs a fifth of the time.

        Returns:
            How far the closing moved the object; what comes later is measured from after it.
        """
        physics, p = self._physics, self.parameters
        physics.set_object(mass_kg, friction)
        at_grasp = stages[len(stages) // 2].transform_palm_to_object
        object_to_stand = np.asarray(np.linalg.inv(at_grasp), dtype=np.float64)
        placed = object_to_stand if transform_error is None else object_to_stand @ transform_error
        palms = [object_to_stand @ stage.transform_palm_to_object for stage in stages]
        physics.put(palms[0], stages[0].joints, placed)
        steps = self._steps(p.closing_time_s)
        for k in range(1, len(stages)):
            way = between(palms[k - 1], palms[k])
            for i in range(1, steps + 1):
                share = i / steps
                physics.step(way(share), (1.0 - share) * stages[k - 1].joints + share * stages[k].joints)
        self._palm, self._squeezed = palms[-1], stages[-1].joints
        for _ in range(round(p.settling_time_s / p.time_step_s)):
            physics.step(self._palm, self._squeezed)
        self._slip = None
        self._start = placed_in(physics.fingers.palm_pose(), placed)
        moved = self.drift()
        physics.save()
        self._begin(meter_slip)
        return moved

    def restore(self) -> None:
        """Return to the state after the last `grasp`."""
        self._physics.restore(self._palm)
        self._begin(self._slip is not None)

    def hold(self, force_n: FloatArray, time_s: float, lost: Callable[[Drift], bool]) -> Drift:
        """Apply a constant force at the object's centre, stand frame, shape (3,).

        It ends when time is up or the object is lost, or before that when hand and object are at rest under
        the force: nothing would come after it.
        """
        drift = before = self.drift()
        rest = max(1, round(_REST_S / _LOOK_S))
        for k in range(1, self._steps(time_s) + 1):
            self._physics.step(self._palm, self._squeezed, force_n)
            if k % self._look == 0:
                drift = self._looked()
                if lost(drift):
                    break
                if (k // self._look) % rest == 0:
                    moved = abs(drift.moved_m - before.moved_m)
                    if moved < _REST_M and abs(drift.turned_deg - before.turned_deg) < _REST_DEG:
                        break
                    before = drift
        return drift

    def move(self, goes: Goes, force_n: FloatArray, time_s: float, lost: Callable[[Drift], bool]) -> Drift:
        """Carry the object along a motion of the palm, with a force on it; as `hold`."""
        steps, drift = self._steps(time_s), self.drift()
        for k in range(1, steps + 1):
            self._physics.step(goes(k / steps), self._squeezed, force_n)
            if k % self._look == 0:
                drift = self._looked()
                if lost(drift):
                    break
        return drift

    def ramp(
        self,
        force_n: FloatArray,
        torque_nm: FloatArray,
        time_s: float,
        lost: Callable[[Drift], bool],
        *,
        force_kept_n: FloatArray | None = None,
        palm: FloatArray | None = None,
    ) -> float:
        """Let force and torque grow from nothing; return the share at which it was still held, 0 to 1.

        Args:
            force_n: At the end, at the object's centre, stand frame, shape (3,).
            torque_nm: At the end, shape (3,).
            time_s: How long they grow.
            lost: What ends it.
            force_kept_n: A force that is there all the time, shape (3,).
            palm: Where the palm stays, shape (4, 4); None: where it closed.
        """
        steps, resisted = self._steps(time_s), 0.0
        kept = np.zeros(3) if force_kept_n is None else force_kept_n
        stays = self._palm if palm is None else palm
        for k in range(1, steps + 1):
            share = k / steps
            self._physics.step(stays, self._squeezed, kept + share * force_n, share * torque_nm)
            if k % self._look == 0 or k == steps:
                if lost(self._looked()):
                    break
                resisted = share
        return resisted

    def drift(self) -> Drift:
        """Return how far the object is from where it was when the hand had closed."""
        now = self._physics.object_in_palm()
        touches = self._physics.fingers.touching(_CONTACT_FORCE_N)
        slip = 0.0 if self._slip is None else self._slip.slip_m
        moved = float(np.linalg.norm(now[:3, 3] - self._start[:3, 3]))
        return Drift(moved, turn_deg(self._start, now), slip, touches)

    def object_pose(self) -> FloatArray:
        """Return the object's pose in the stand, shape (4, 4)."""
        return self._physics.object_pose()

    @property
    def palm(self) -> FloatArray:
        """Where the palm is wanted after the closing, stand frame, shape (4, 4)."""
        return self._palm.copy()

    @property
    def _look(self) -> int:
        return max(1, round(_LOOK_S / self.parameters.time_step_s))

    def _steps(self, time_s: float) -> int:
        return max(1, round(time_s / self.parameters.time_step_s))

    def _begin(self, meter_slip: bool) -> None:
        self._start = self._physics.object_in_palm()
        self._slip = None
        if meter_slip:
            fingers = tuple(range(self.hand.n_fingers))
            self._slip = SlipMeter(self._physics.fingers, fingers, _CONTACT_FORCE_N)
            self._slip.look()

    def _looked(self) -> Drift:
        if self._slip is not None:
            self._slip.look()
        return self.drift()


def placed_in(transform_palm: FloatArray, transform_object: FloatArray) -> FloatArray:
    """Return the pose of the object in the palm frame, shape (4, 4)."""
    pose: FloatArray = np.linalg.inv(transform_palm) @ transform_object
    return pose
