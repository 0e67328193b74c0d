"""What a protocol is: a trial of a grasp in physics, with its own notion of success."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.evaluation.grasp_record import GraspRecord, HandPose
from graspbench.evaluation.judge import Judgement
from graspbench.registry import Registry
from graspbench.simulation.hold_stand import HoldStand


@dataclass(frozen=True)
class ProtocolOutcome:
    """What came of a grasp under a protocol.

    Attributes:
        success: Whether it is one by the protocol.
        value: How good it is by the protocol, the larger the better; its unit is the protocol's.
        reason: Why it is no success, one clause; None if it is.
        details: Further values by name.
    """

    success: bool
    value: float
    reason: str | None = None
    details: Mapping[str, float] = field(default_factory=dict)


class GraspProtocol(Protocol):
    """A frozen dataclass of parameters that tries grasps; registered by its name in `PROTOCOLS`."""

    description: ClassVar[str]
    """What a success is, one sentence."""

    unit: ClassVar[str]
    """Unit of the outcomes' values."""

    def run(self, stand: HoldStand, record: GraspRecord, judgement: Judgement, seed: int) -> ProtocolOutcome:
        """Try a grasp that has a hand.

        Args:
            stand: Hand and object.
            record: The grasp.
            judgement: What the judge says of it; it has the hand open and squeezed.
            seed: Source of every random draw.
        """
        ...


PROTOCOLS: Registry[type[GraspProtocol]] = Registry("protocol", "graspbench.evaluation.protocols")


def stages_of(record: GraspRecord, judgement: Judgement) -> tuple[HandPose, HandPose, HandPose]:
    """Return the hand open, touching and squeezed: palms as stated, joints as the judge closed them."""
    grasp, opened = record.grasp, judgement.opened
    closed, squeezed = judgement.closed, judgement.squeezed
    assert grasp is not None, "the caller has looked"
    assert opened is not None, "the judge completes what has a hand"
    assert closed is not None, "the judge completes what has a hand"
    assert squeezed is not None, "the judge completes what has a hand"
    first, last = record.pregrasp or grasp, record.squeeze or grasp
    return (
        HandPose(first.transform_palm_to_object, opened.joints),
        HandPose(grasp.transform_palm_to_object, closed.joints),
        HandPose(last.transform_palm_to_object, squeezed.joints),
    )


def up_in_stand(stand: HoldStand, record: GraspRecord) -> FloatArray:
    """Return the direction against gravity in the stand, for the object as it is there, shape (3,)."""
    return np.asarray(stand.object_pose()[:3, :3] @ record.up, dtype=np.float64)
