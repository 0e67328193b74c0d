"""Our graded protocol: how large a force or torque a grasp resists before it slips, in every direction."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.evaluation.judge import Judgement
from graspbench.evaluation.protocols.protocol import PROTOCOLS, ProtocolOutcome, stages_of
from graspbench.simulation.hold_stand import Drift, HoldStand


def force_directions() -> FloatArray:
    """Return the 26 directions to faces, edges and corners of a cube, unit, shape (26, 3)."""
    steps = np.array(np.meshgrid(*3 * [[-1.0, 0.0, 1.0]], indexing="ij")).reshape(3, -1).T
    steps = steps[np.any(steps != 0.0, axis=1)]
    return np.asarray(steps / np.linalg.norm(steps, axis=1, keepdims=True))


TORQUE_AXES = np.vstack((np.eye(3), -np.eye(3)))


@PROTOCOLS.register("resist")
@dataclass(frozen=True)
class Resist:
    """Forces in 26 directions and torques about 3 axes grow until the object slips, without gravity.

    The value is the force resisted in the weakest direction. It knows of no measure: what it is compared with
    shares nothing with it.
    """

    mass_kg: Annotated[float, Field(gt=0, description="The object's mass, kg")] = 0.1
    friction: Annotated[float, Field(gt=0, description="Coulomb friction between hand and object")] = 0.6
    needed_weight: Annotated[
        float, Field(gt=0, description="A success resists this in each direction, multiples of the weight")
    ] = 1.0
    limit_weight: Annotated[
        float, Field(gt=0, description="Largest force tried, multiples of the weight")
    ] = 20.0
    torque_limit_nm: Annotated[float, Field(gt=0, description="Largest torque tried, N m")] = 0.4
    ramp_time_s: Annotated[float, Field(gt=0, description="Time in which each of them grows to it, s")] = 0.6
    slip_m: Annotated[
        float, Field(gt=0, description="Net sliding at a contact that counts as slipping, m")
    ] = 0.002
    drop_m: Annotated[float, Field(gt=0, description="Way of the object that counts as lost, m")] = 0.02
    drop_deg: Annotated[float, Field(gt=0, description="Turn of the object that counts as lost, deg")] = 20.0

    description: ClassVar[str] = (
        "forces in 26 directions grow until the object slips; a success resists its weight in each"
    )
    unit: ClassVar[str] = "weight"

    def run(self, stand: HoldStand, record: GraspRecord, judgement: Judgement, seed: int) -> ProtocolOutcome:
        """Try a grasp; see `GraspProtocol.run`."""
        del seed
        closing = stand.grasp(stages_of(record, judgement), self.mass_kg, self.friction)
        if closing.fingers == 0 or closing.moved_m > 0.05:
            return ProtocolOutcome(False, 0.0, "the closing lost the object", self._nothing())
        turn, nothing = stand.object_pose()[:3, :3], np.zeros(3)
        forces, torques = [], []
        for direction in force_directions():
            stand.restore()
            limit_n = self.limit_weight * stand.weight_n
            share = stand.ramp(limit_n * (turn @ direction), nothing, self.ramp_time_s, self._slips)
            forces.append(share * self.limit_weight)
        for axis in TORQUE_AXES:
            stand.restore()
            share = stand.ramp(nothing, self.torque_limit_nm * (turn @ axis), self.ramp_time_s, self._slips)
            torques.append(share * self.torque_limit_nm)
        weakest = min(forces)
        reason = None if weakest >= self.needed_weight else f"it slipped at {weakest:.2g} weights"
        details = {
            "force_min_weight": weakest,
            "force_mean_weight": float(np.mean(forces)),
            "torque_min_nm": min(torques),
            "torque_mean_nm": float(np.mean(torques)),
        }
        return ProtocolOutcome(reason is None, weakest, reason, details)

    @staticmethod
    def _nothing() -> dict[str, float]:
        names = ("force_min_weight", "force_mean_weight", "torque_min_nm", "torque_mean_nm")
        return dict.fromkeys(names, 0.0)

    def _slips(self, drift: Drift) -> bool:
        lost = drift.moved_m > self.drop_m or drift.turned_deg > self.drop_deg or drift.fingers == 0
        return lost or drift.slip_m > self.slip_m
