"""Protocols in which the object has its weight: lifted, tugged, shaken, and lifted again with errors."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.evaluation.judge import Judgement
from graspbench.evaluation.protocols.protocol import PROTOCOLS, ProtocolOutcome, stages_of, up_in_stand
from graspbench.simulation.hold_stand import Drift, HoldStand
from graspbench.simulation.phases import smooth

_RISE_M = 0.02
_LOADING_S = 0.2


@dataclass(frozen=True)
class _Carried:
    """An object that floats until the hand has closed, gets its weight then, and is lifted."""

    mass_kg: Annotated[
        float | None, Field(gt=0, description="The object's mass, kg; null: the object's own")
    ] = None
    friction: Annotated[float, Field(gt=0, description="Coulomb friction between hand and object")] = 0.6
    lift_m: Annotated[float, Field(gt=0, description="Height of the lift, m")] = 0.2
    lift_time_s: Annotated[float, Field(gt=0, description="Duration of the lift, s")] = 0.6
    drop_m: Annotated[float, Field(gt=0, description="Lost when the object moved by more in the palm, m")] = (
        0.05
    )
    drop_deg: Annotated[
        float, Field(gt=0, description="Lost when the object turned by more in the palm, deg")
    ] = 45.0

    unit: ClassVar[str] = "1"

    def lifted(
        self,
        stand: HoldStand,
        record: GraspRecord,
        judgement: Judgement,
        transform_error: FloatArray | None = None,
        lift_m: float | None = None,
    ) -> tuple[str | None, FloatArray, FloatArray]:
        """Lift the object; return why it was lost, its weight, shape (3,), and the palm's pose then."""
        mass_kg = stand.object_model.mass_kg if self.mass_kg is None else self.mass_kg
        stages = stages_of(record, judgement)
        closing = stand.grasp(stages, mass_kg, self.friction, transform_error=transform_error)
        upwards = up_in_stand(stand, record)
        weight, low = -stand.weight_n * upwards, stand.palm
        if closing.fingers == 0:
            return "no finger touched the object after the closing", weight, low
        if closing.moved_m > self.drop_m:
            return f"the closing moved the object by {1e3 * closing.moved_m:.0f} mm", weight, low
        if stand.ramp(weight, np.zeros(3), _LOADING_S, self.is_lost) < 1.0:
            return "the object was lost under its weight", weight, low
        height = self.lift_m if lift_m is None else lift_m

        def rising(share: float) -> FloatArray:
            pose = low.copy()
            pose[:3, 3] += smooth(share) * height * upwards
            return pose

        before = stand.object_pose()[:3, 3]
        drift = stand.move(rising, weight, self.lift_time_s, self.is_lost)
        risen = float((stand.object_pose()[:3, 3] - before) @ upwards)
        if self.is_lost(drift) or risen < 0.5 * height:
            return f"the object slipped {1e3 * drift.moved_m:.0f} mm in the lift", weight, rising(1.0)
        return None, weight, rising(1.0)

    def is_lost(self, drift: Drift) -> bool:
        """Tell whether the object is lost."""
        return drift.moved_m > self.drop_m or drift.turned_deg > self.drop_deg or drift.fingers == 0


def _staying(pose: FloatArray) -> Callable[[float], FloatArray]:
    return lambda _: pose


@PROTOCOLS.register("lift")
@dataclass(frozen=True)
class Lift(_Carried):
    """The object is lifted and held."""

    hold_time_s: Annotated[float, Field(gt=0, description="How long it is held then, s")] = 0.5

    description: ClassVar[str] = "the object is lifted and held"

    def run(self, stand: HoldStand, record: GraspRecord, judgement: Judgement, seed: int) -> ProtocolOutcome:
        """Try a grasp; see `GraspProtocol.run`."""
        del seed
        reason, weight, palm = self.lifted(stand, record, judgement)
        if reason is not None:
            return ProtocolOutcome(False, 0.0, reason)
        drift = stand.move(_staying(palm), weight, self.hold_time_s, self.is_lost)
        details = {"moved_m": drift.moved_m, "turned_deg": drift.turned_deg, "slip_m": drift.slip_m}
        if self.is_lost(drift):
            return ProtocolOutcome(False, 0.0, "the object was lost in the hold", details)
        return ProtocolOutcome(True, 1.0, None, details)


@PROTOCOLS.register("tug")
@dataclass(frozen=True)
class Tug(_Carried):
    """The object is lifted, and resists a pull out of the hand, away from the palm."""

    tug_weight: Annotated[
        float, Field(gt=0, description="The pull, multiples of the weight, beside the weight itself")
    ] = 2.0
    tug_time_s: Annotated[float, Field(gt=0, description="Time in which the pull grows to that, s")] = 0.8

    description: ClassVar[str] = "the object is lifted, and resists a pull away from the palm"
    unit: ClassVar[str] = "weight"

    def run(self, stand: HoldStand, record: GraspRecord, judgement: Judgement, seed: int) -> ProtocolOutcome:
        """Try a grasp; see `GraspProtocol.run`."""
        del seed
        reason, weight, palm = self.lifted(stand, record, judgement, lift_m=_RISE_M)
        if reason is not None:
            return ProtocolOutcome(False, 0.0, reason)
        away = self.tug_weight * stand.weight_n * palm[:3, 2]
        share = stand.ramp(away, np.zeros(3), self.tug_time_s, self.is_lost, force_kept_n=weight, palm=palm)
        resisted = share * self.tug_weight
        if share < 1.0:
            return ProtocolOutcome(False, resisted, f"the object was pulled out by {resisted:.2g} weights")
        return ProtocolOutcome(True, resisted)


@PROTOCOLS.register("shake")
@dataclass(frozen=True)
class Shake(_Carried):
    """The object is lifted, and stays in the hand while that is shaken along three axes."""

    amplitude_m: Annotated[float, Field(gt=0, description="Amplitude of the shakes, m")] = 0.02
    frequency_hz: Annotated[
        float, Field(gt=0, description="Frequency of the shakes, Hz; the peak is (2 pi f)^2 amplitude")
    ] = 4.0
    shake_time_s: Annotated[float, Field(gt=0, description="Duration of the shake along an axis, s")] = 0.75

    description: ClassVar[str] = (
        "the object is lifted, and stays in the hand while it is shaken along three axes"
    )
    unit: ClassVar[str] = "share of the axes"

    def run(self, stand: HoldStand, record: GraspRecord, judgement: Judgement, seed: int) -> ProtocolOutcome:
        """Try a grasp; see `GraspProtocol.run`."""
        del seed
        reason, weight, palm = self.lifted(stand, record, judgement, lift_m=_RISE_M)
        if reason is not None:
            return ProtocolOutcome(False, 0.0, reason)
        for axis, name in enumerate("xyz"):
            drift = stand.move(self._shaken(palm, axis), weight, self.shake_time_s, self.is_lost)
            if self.is_lost(drift):
                return ProtocolOutcome(False, axis / 3.0, f"the object was lost in the shake along {name}")
        return ProtocolOutcome(True, 1.0)

    def _shaken(self, rest: FloatArray, axis: int) -> Callable[[float], FloatArray]:
        def motion(share: float) -> FloatArray:
            # It grows in the first quarter and fades in the last.
            envelope = smooth(4.0 * share) * smooth(4.0 * (1.0 - share))
            phase = 2.0 * np.pi * self.frequency_hz * self.shake_time_s * share
            pose = rest.copy()
            pose[:3, 3] += self.amplitude_m * envelope * np.sin(phase) * rest[:3, axis]
            return pose

        return motion


@PROTOCOLS.register("half_of_trials")
@dataclass(frozen=True)
class HalfOfTrials(_Carried):
    """At least half of several lifts succeed, each with the object placed with an error."""

    trials: Annotated[int, Field(ge=1, le=1000, description="Lifts")] = 6
    position_error_m: Annotated[
        float, Field(ge=0, description="Standard deviation of the object's place along each axis, m")
    ] = 0.004
    turn_error_deg: Annotated[
        float, Field(ge=0, description="Standard deviation of the object's turn about each axis, deg")
    ] = 3.0
    needed: Annotated[float, Field(gt=0, le=1, description="Share of the lifts that must succeed")] = 0.5

    description: ClassVar[str] = "at least half of several lifts succeed, the object placed with errors"
    unit: ClassVar[str] = "share of the lifts"

    def run(self, stand: HoldStand, record: GraspRecord, judgement: Judgement, seed: int) -> ProtocolOutcome:
        """Try a grasp; see `GraspProtocol.run`."""
        generator = np.random.default_rng(seed)
        succeeded = 0
        for _ in range(self.trials):
            error = np.eye(4)
            turn = generator.normal(0.0, np.radians(self.turn_error_deg), 3)
            error[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
            error[:3, 3] = generator.normal(0.0, self.position_error_m, 3)
            reason, _, _ = self.lifted(stand, record, judgement, error, lift_m=3.0 * _RISE_M)
            succeeded += reason is None
        share = succeeded / self.trials
        reason = None if share >= self.needed else f"{succeeded} of {self.trials} lifts succeeded"
        return ProtocolOutcome(reason is None, share, reason)
