"""The judge: what a grasp is worth without physics, whoever planned it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.evaluation.bodies import HandBodies, ObjectBody
from graspbench.evaluation.closing import (
    ClosedHand,
    close_hand,
    closing_way,
    is_stated,
    nearest_of,
    squeezed_joints,
)
from graspbench.evaluation.grasp_record import ContactSet, GraspRecord, HandPose
from graspbench.geometry.model import ObjectModel
from graspbench.grasp.closure import CLOSURE_TOLERANCE
from graspbench.grasp.measure import MEASURES, evaluate_measures
from graspbench.grasp.quality import QualityParameters
from graspbench.hand.model import HandModel
from graspbench.hand.verification import overlaps
from graspbench.simulation.stand_parameters import StandParameters

_MAX_DEPTH_M = 0.05


@dataclass(frozen=True)
class JudgeParameters:
    """How grasps are judged without physics."""

    opening_m: Annotated[
        float, Field(gt=0, description="Tips open by this before they close, where no pregrasp is given, m")
    ] = 0.02
    squeezing_m: Annotated[
        float, Field(gt=0, description="Tips close up to this beyond the grasp, where no squeeze is given, m")
    ] = 0.01
    grip_force_n: Annotated[
        float,
        Field(gt=0, description="Mean normal force of a made-up squeeze, up to what springs keep steady, N"),
    ] = 3.0
    limit_tolerance_deg: Annotated[
        float, Field(ge=0, description="Joints may be outside their limits by this, deg (slides: mm)")
    ] = 0.1


@dataclass(frozen=True, eq=False)
class Judgement:
    """What a grasp is worth without physics.

    Attributes:
        contacts: Where the closed hand touches the object, one contact a link; those stated where the
            record has no hand.
        fingers: Finger of each contact, -1 for the palm; empty where the record has no hand.
        opened: The hand open; None where the record has no hand, here and below.
        closed: The hand after it closed, joints at the object.
        squeezed: Where its joints would go without the object.
        depth_m: How deep the hand as stated is in the object: the deepest overlap of a link with a convex
            part of it, up to 50 mm; nan without a hand.
        violations: What is wrong with the posture, one clause each: limits, links that overlap.
        measures: Every registered measure of the contacts by name; nan with less than two contacts.
        force_closure: Whether the contacts resist any wrench.
    """

    contacts: ContactSet
    fingers: tuple[int, ...]
    opened: HandPose | None
    closed: HandPose | None
    squeezed: HandPose | None
    depth_m: float
    violations: tuple[str, ...]
    measures: Mapping[str, float]
    force_closure: bool


class Judge:
    """Judges grasps of one hand on one object.

    Args:
        hand: The hand.
        object_model: The object.
        parameters: How to judge.
        quality: How contacts and wrenches are modelled.
        measures: Names of the measures; None: every registered one.
        stiffness_nm_rad: Of the joints that a squeeze is made up for.
    """

    def __init__(
        self,
        hand: HandModel,
        object_model: ObjectModel,
        parameters: JudgeParameters | None = None,
        quality: QualityParameters | None = None,
        measures: Sequence[str] | None = None,
        stiffness_nm_rad: float = StandParameters.stiffness_nm_rad,
    ) -> None:
        self.hand, self.object_model = hand, object_model
        self._stiffness_nm_rad = stiffness_nm_rad
        self.parameters = JudgeParameters() if parameters is None else parameters
        self.quality = QualityParameters() if quality is None else quality
        self.measures = tuple(MEASURES) if measures is None else tuple(measures)
        self._bodies, self._body = HandBodies(hand), ObjectBody(object_model)
        self._length_m = self.quality.torque_length_m(np.asarray(object_model.mesh.vertices), np.zeros(3))

    def judge(self, records: Sequence[GraspRecord]) -> tuple[Judgement, ...]:
        """Judge grasps; measures of grasps with as many contacts are computed together."""
        judged = [self._without_measures(record) for record in records]
        values = self._measured([each.contacts for each in judged])
        return tuple(
            replace(each, measures=measured, force_closure=measured.get("q3", 0.0) > CLOSURE_TOLERANCE)
            for each, measured in zip(judged, values, strict=True)
        )

    def completed(self, record: GraspRecord) -> GraspRecord:
        """Return a record with a pregrasp and a squeeze, made up where it states none."""
        if record.grasp is None:
            return record
        _, opened, squeezed = self._closed(record)
        return replace(record, pregrasp=record.pregrasp or opened, squeeze=record.squeeze or squeezed)

    def depth_m(self, pose: HandPose) -> float:
        """Return how deep a hand is in the object, m; see `Judgement`."""
        everything = np.arange(len(self._bodies.shapes))
        palm, joints = pose.transform_palm_to_object, pose.joints
        nears = nearest_of(self._bodies, self._body, palm, joints, everything, 0.0)
        return min(-nears[0].distance_m, _MAX_DEPTH_M) if nears else 0.0

    def violations(self, joints: FloatArray) -> tuple[str, ...]:
        """Return what is wrong with a posture, one clause each."""
        tolerance = np.radians(self.parameters.limit_tolerance_deg)
        below, above = self.hand.lower - tolerance, self.hand.upper + tolerance
        outside = np.flatnonzero((joints < below) | (joints > above))
        limits = tuple(f"joint '{self.hand.joint_names[i]}' is outside its limits" for i in outside)
        return limits + overlaps(self.hand, joints)

    def _without_measures(self, record: GraspRecord) -> Judgement:
        grasp = record.grasp
        if grasp is None:
            assert record.contacts is not None, "a record has a hand or contacts"
            return Judgement(record.contacts, (), None, None, None, np.nan, (), {}, False)
        closed, opened, squeezed = self._closed(record)
        return Judgement(
            contacts=closed.contacts,
            fingers=tuple(closed.fingers.tolist()),
            opened=opened,
            closed=HandPose(grasp.transform_palm_to_object, closed.joints),
            squeezed=squeezed,
            depth_m=self.depth_m(grasp),
            violations=self.violations(grasp.joints),
            measures={},
            force_closure=False,
        )

    def _closed(self, record: GraspRecord) -> tuple[ClosedHand, HandPose, HandPose]:
        """Return a hand closed, and open and squeezed as stated or as made up."""
        assert record.grasp is not None, "the caller has looked"
        p, palm = self.parameters, record.grasp.transform_palm_to_object
        opened, grasp, beyond = closing_way(record, self._bodies, self._body, p.opening_m, p.squeezing_m)
        closed = close_hand(self._bodies, self._body, palm, (opened, grasp, beyond))
        squeezed = beyond
        if not is_stated(record.squeeze, record.grasp):
            squeezed = squeezed_joints(
                self._bodies, closed, palm, p.grip_force_n, self._stiffness_nm_rad, self.quality.friction
            )
        return closed, HandPose(palm, opened), HandPose(palm, squeezed)

    def _measured(self, contacts: Sequence[ContactSet]) -> list[dict[str, float]]:
        values = [dict.fromkeys(self.measures, np.nan) for _ in contacts]
        counts = np.array([len(each.points) for each in contacts])
        for count in np.unique(counts[counts >= 2]):
            which = np.flatnonzero(counts == count).tolist()
            measured = evaluate_measures(
                self.measures,
                np.stack([contacts[i].points for i in which]),
                -np.stack([contacts[i].normals for i in which]),
                np.zeros(3),
                self.quality,
                self._length_m,
            )
            for name, found in measured.items():
                for i, value in zip(which, found, strict=True):
                    values[i][name] = float(value)
        return values
