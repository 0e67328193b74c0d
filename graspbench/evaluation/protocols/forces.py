"""Pure forces along six axes: all of them resisted, or one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.evaluation.judge import Judgement
from graspbench.evaluation.protocols.protocol import PROTOCOLS, ProtocolOutcome, stages_of
from graspbench.simulation.hold_stand import Drift, HoldStand

AXES = np.vstack((np.eye(3), -np.eye(3)))
AXIS_NAMES = ("+x", "+y", "+z", "-x", "-y", "-z")


@dataclass(frozen=True)
class _AxisForces:
    """Forces along the object's axes, one after the other, each on the grasp as it closed."""

    mass_kg: Annotated[float, Field(gt=0, description="The object's mass, kg")] = 0.1
    friction: Annotated[float, Field(gt=0, description="Coulomb friction between hand and object")] = 0.6
    force_weight: Annotated[float, Field(gt=0, description="Each force, multiples of the weight")] = 1.0
    force_time_s: Annotated[float, Field(gt=0, description="How long each force lasts, s")] = 1.0
    drop_m: Annotated[float, Field(gt=0, description="Lost when the object moved by more, m")] = 0.05
    drop_deg: Annotated[float, Field(gt=0, description="Lost when the object turned by more, deg")] = 15.0

    unit: ClassVar[str] = "share of the forces"

    def held(
        self, stand: HoldStand, record: GraspRecord, judgement: Judgement, *, stop_when: bool | None = None
    ) -> tuple[list[bool], Drift]:
        """Return which forces were resisted, up to the first of outcome ``stop_when``, and the closing."""
        closing = stand.grasp(stages_of(record, judgement), self.mass_kg, self.friction, meter_slip=False)
        if self._is_lost(closing) or closing.fingers == 0:
            return [], closing
        turn, force_n = stand.object_pose()[:3, :3], self.force_weight * stand.weight_n
        held: list[bool] = []
        for axis in AXES:
            if held:
                stand.restore()
            drift = stand.hold(force_n * (turn @ axis), self.force_time_s, self._is_lost)
            held.append(not self._is_lost(drift))
            if held[-1] == stop_when:
                break
        return held, closing

    def _is_lost(self, drift: Drift) -> bool:
        return drift.moved_m > self.drop_m or drift.turned_deg > self.drop_deg


def _closing_failed(closing: Drift) -> ProtocolOutcome:
    if closing.fingers == 0:
        return ProtocolOutcome(False, 0.0, "no finger touched the object after the closing")
    reason = f"the closing moved the object by {1e3 * closing.moved_m:.0f} mm, {closing.turned_deg:.0f} deg"
    return ProtocolOutcome(False, 0.0, reason)


def _lost_along(held: Sequence[bool]) -> str:
    return f"the object was lost under a force along {AXIS_NAMES[list(held).index(False)]} of its frame"


@PROTOCOLS.register("six_forces")
@dataclass(frozen=True)
class SixForces(_AxisForces):
    """All of six pure forces along the object's axes are resisted, as in DexGraspBench."""

    description: ClassVar[str] = (
        "all of six pure forces along the object's axes are resisted, without gravity"
    )

    def run(self, stand: HoldStand, record: GraspRecord, judgement: Judgement, seed: int) -> ProtocolOutcome:
        """Try a grasp; see `GraspProtocol.run`."""
        del seed
        held, closing = self.held(stand, record, judgement)
        if not held:
            return _closing_failed(closing)
        reason = None if all(held) else _lost_along(held)
        return ProtocolOutcome(all(held), sum(held) / len(AXES), reason, {"closing_moved_m": closing.moved_m})


@PROTOCOLS.register("one_of_six")
@dataclass(frozen=True)
class OneOfSix(_AxisForces):
    """One at least of six pure forces is resisted, as in DexGraspNet, and the hand is not in the object."""

    max_depth_m: Annotated[
        float, Field(gt=0, description="No success where the hand as stated is deeper in the object, m")
    ] = 0.001

    description: ClassVar[str] = (
        "one at least of six pure forces along the object's axes is resisted; the hand is not in the object"
    )

    def run(self, stand: HoldStand, record: GraspRecord, judgement: Judgement, seed: int) -> ProtocolOutcome:
        """Try a grasp; see `GraspProtocol.run`."""
        del seed
        if judgement.depth_m > self.max_depth_m:
            return ProtocolOutcome(False, 0.0, f"the hand is {1e3 * judgement.depth_m:.1f} mm in the object")
        held, closing = self.held(stand, record, judgement, stop_when=True)
        if not held:
            return _closing_failed(closing)
        reason = None if any(held) else "the object was lost under each of the six forces"
        return ProtocolOutcome(any(held), float(any(held)), reason)
