"""Fingers that step over the held object one by one while a path of the joints is played."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.grip import Grip
from graspbench.simulation.in_hand_path import InHandPath, StepOnPath
from graspbench.simulation.stage import Stage

_LET_GO_S, _LAND_S, _TAKE_HOLD_S = 0.25, 0.4, 0.25
_CHANGE_S = 0.04
"""Time constant with which the forces change over from some fingers to others."""
_MIN_HOLDING = 2
_FELT = 3.0
"""Times the least force that counts as a touch, a finger that slides presses at least."""
_YIELDING_M_SN = 0.01
"""Speed at which a finger that slides gives way along the normal, per newton that it presses too much."""
_LANDING = 0.7
"""Share of a step after which a touch ends it."""


class _Doing(Enum):
    MOVE = "all fingers move the object"
    LET_GO = "the path waits, the other fingers take over"
    STEP = "the finger goes along the path"
    LAND = "the path waits, the finger goes on till it touches"
    TAKE_HOLD = "the path waits, the finger takes its share"


@dataclass(frozen=True)
class _Span:
    doing: _Doing
    from_s: float
    to_s: float
    path_from_s: float
    path_to_s: float
    step: StepOnPath | None


class FingerWalk:
    """Lets go with a finger where a path has it step, and takes hold where it lands.

    Before a step the path waits while the other fingers take over grip and weight. A finger that comes to the
    end of its step without a touch goes on along the normal until it feels one. Its springs then relax where
    it is, and it takes its share of grip and weight again.

    Args:
        stage: Hand and object.
        grip: The object in the hand.
        fingers: Finger of each contact.
        path: What is played.

    Attributes:
        duration_s: How long it takes, waiting included.
        missed: Steps so far that ended without a touch.
        lost: How the object is lost, one clause: a finger has to step and less than two others hold it.
    """

    def __init__(self, stage: Stage, grip: Grip, fingers: tuple[int, ...], path: InHandPath) -> None:
        self._stage, self._grip, self._control = stage, grip, grip.control
        self._own = [stage.model.finger_joints(finger) for finger in fingers]
        self._fingers = fingers
        self._spans = _spans(path)
        self._ends = np.array([span.to_s for span in self._spans])
        self._offset = self._control.rest - path.joints[0]
        self._holding = np.ones(len(fingers), dtype=np.bool_)
        self._sliding = path.sliding
        self._sliding_n = max(path.sliding_n, _FELT * stage.parameters.contact_force_n)
        if path.sliding:
            self._holding[list(path.sliding)] = False
            self._control.stand_on(self._holding, _CHANGE_S, self._sliding_n)
        self._touched = False
        self._now = self._spans[0]
        self.duration_s = float(self._ends[-1])
        self.missed = 0
        self.lost: str | None = None

    def at(self, clock_s: float) -> float:
        """Go on to a time since the start; return the path's time then."""
        span = self._spans[min(int(np.searchsorted(self._ends, clock_s)), len(self._spans) - 1)]
        if span is not self._now:
            self._now = span
            self._begin(span)
        share = (clock_s - span.from_s) / max(span.to_s - span.from_s, 1e-9)
        return span.path_from_s + share * (span.path_to_s - span.path_from_s)

    def rest(self, joints: FloatArray, time_s: float) -> FloatArray:
        """Return the posture in which the fingers' springs are relaxed, shape (n_q,).

        Args:
            joints: The path's, shape (n_q,).
            time_s: The path's time.
        """
        span = self._now
        if span.step is not None and span.doing in (_Doing.STEP, _Doing.LAND):
            own = self._own[span.step.contact]
            length = span.step.to_s - span.step.from_s
            landing = span.doing is _Doing.LAND or time_s > span.step.from_s + _LANDING * length
            if landing and not self._touched and self._control.touches()[span.step.contact] is not None:
                self._touched = True
                self._resting = self._stage.hand.state()[0][own]
            if self._touched:
                self._offset[own] = self._resting - joints[own]
            elif span.doing is _Doing.LAND:
                self._offset[own] += self._stage.time_step_s * self._joint_velocities(
                    span.step.contact,
                    joints + self._offset,
                    self._stage.parameters.closing_speed_m_s * span.step.inward,
                )
        for contact in self._sliding:
            self._press(contact, joints)
        rest: FloatArray = joints + self._offset
        return rest

    def _press(self, contact: int, joints: FloatArray) -> None:
        """Let a sliding finger's springs give way until it presses as it shall.

        Where the surface is not just where it was seen, the springs would press with many times the force
        that the finger is to slide with, and drag the object, or not at all.
        """
        felt = self._control.touches()[contact]
        missing_n = self._sliding_n - (0.0 if felt is None else felt.force_n)
        fastest = self._stage.parameters.closing_speed_m_s
        speed = float(np.clip(_YIELDING_M_SN * missing_n, -fastest, fastest))
        inward = self._grip.object_in_palm()[:3, :3] @ self._control.normals[contact]
        self._offset[self._own[contact]] += self._stage.time_step_s * self._joint_velocities(
            contact, joints + self._offset, speed * inward
        )

    def _begin(self, span: _Span) -> None:
        if span.step is None:
            return
        contact = span.step.contact
        if span.doing is _Doing.LET_GO:
            self._holding[contact] = self._touched = False
            if self._holding.sum() < _MIN_HOLDING:
                self.lost = f"{self.missed} finger(s) missed the object, too few are left to step"
                return
            self._control.stand_on(self._holding, _CHANGE_S)
        elif span.doing is _Doing.STEP:
            self._grip.begin_contact(contact)
        elif span.doing is _Doing.TAKE_HOLD:
            if self._touched:
                self._holding[contact] = True
                self._control.stand_on(self._holding, _CHANGE_S)
            else:
                self.missed += 1

    def _joint_velocities(self, contact: int, rest: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return joint velocities, shape (k,), that move a contact's tip as wanted, shape (3,), palm axes."""
        own = self._own[contact]
        jacobian = self._stage.model.tip_jacobians(rest)[self._fingers[contact]][:, own]
        damped = jacobian @ jacobian.T + 1e-6 * np.eye(3)
        velocities: FloatArray = jacobian.T @ np.linalg.solve(damped, velocity)
        return velocities


def _spans(path: InHandPath) -> tuple[_Span, ...]:
    """Return what is done when: the path's pieces and the waiting between them."""
    spans: list[_Span] = []

    def add(
        doing: _Doing, time_s: float, path_from_s: float, path_to_s: float, step: StepOnPath | None
    ) -> None:
        now = spans[-1].to_s if spans else 0.0
        spans.append(_Span(doing, now, now + time_s, path_from_s, path_to_s, step))

    at = 0.0
    for step in path.steps:
        if step.from_s > at:
            add(_Doing.MOVE, step.from_s - at, at, step.from_s, None)
        add(_Doing.LET_GO, _LET_GO_S, step.from_s, step.from_s, step)
        add(_Doing.STEP, step.to_s - step.from_s, step.from_s, step.to_s, step)
        add(_Doing.LAND, _LAND_S, step.to_s, step.to_s, step)
        add(_Doing.TAKE_HOLD, _TAKE_HOLD_S, step.to_s, step.to_s, step)
        at = step.to_s
    end = float(path.times[-1])
    if end > at or not spans:
        add(_Doing.MOVE, end - at, at, end, None)
    return tuple(spans)
