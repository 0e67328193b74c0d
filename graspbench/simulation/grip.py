"""The object in the hand: squeezed, carried about, pushed until it slips."""

from collections.abc import Callable, Sequence

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.controllers.choice import make_control
from graspbench.simulation.execution_result import PhaseOutcome
from graspbench.simulation.phases import Phase, smooth
from graspbench.simulation.slip import SlipMeter
from graspbench.simulation.slip_response import SlipResponse
from graspbench.simulation.stage import Stage, turn_deg
from graspbench.simulation.touch import Touch

_LOOK_S = 0.02


class Grip:
    """The object in the hand, phase by phase.

    Args:
        stage: Hand and object, all fingers in touch.
        fingers: The fingers that touch.
        touches: How each of them touched first.

    Attributes:
        control: The fingers' force control.
        palm: Where the palm is wanted, transform_palm_to_world, shape (4, 4); of a moving object, as planned.
        phases: Outcomes so far, up to the first phase that lost the object.
        reason: Why the object was lost, one clause; None if it was not.
    """

    def __init__(self, stage: Stage, fingers: tuple[int, ...], touches: Sequence[Touch]) -> None:
        self._stage, self._fingers = stage, fingers
        self.control = make_control(stage, fingers, touches)
        self._slip = SlipMeter(stage.hand, fingers, stage.parameters.contact_force_n)
        self._response = self._new_response()
        self._look = max(1, round(_LOOK_S / stage.time_step_s))
        self._ground = stage.world.object_pose()[2, 3]
        self._reference = np.eye(4)
        self.palm = stage.palm_pose()
        self.phases: list[PhaseOutcome] = []
        self.reason: str | None = None

    def squeeze(self) -> bool:
        """Build the grip force up, then take the object's weight; return whether all went well."""
        stage = self._stage
        steps = self._steps(stage.parameters.squeeze_time_s)
        for k in range(steps):
            if k % max(1, steps // 4) == 0:
                self.control.distribute()
            self.control.drive(self._goal(), smooth((k + 1) / steps), 0.0)
            stage.step()
        self.control.distribute()
        self.control.rest_here()
        for k in range(steps // 2):
            self.control.drive(self._goal(), 1.0, smooth((k + 1) / (steps // 2)))
            stage.step()
        self._reference = self.object_in_palm()
        self._slip.look()
        return self._judge("squeeze", load_weight=1.0, lifted=False)

    def move(self, phase: Phase) -> bool:
        """Carry the object along a motion of the palm; return whether it was held."""
        steps = self._steps(phase.time_s)
        centre = self.object_in_palm()[:, 3]
        centres = np.empty((steps + 2, 3))
        centres[:2] = (self._goal() @ centre)[:3]
        self._slip.begin_phase()
        for k in range(1, steps + 1):
            self.palm = phase.motion(k / steps)
            goal = self._goal()
            self.control.drive(goal, 1.0, 1.0)
            self._stage.step()
            centres[k + 1] = (goal @ centre)[:3]
            if k % self._look == 0:
                self._slip.look()
                self._response.feel(self._slip.slip_m)
        return self._judge(phase.name, self._largest_load(centres), lifted=True)

    def play(
        self, name: str, drive: Callable[[int], str | None], steps: int, goal: FloatArray | None = None
    ) -> bool:
        """Let ``drive`` set the fingers' rest posture before each step, the palm at rest; as `move`.

        Args:
            name: Of the phase.
            drive: Called with the number of the step, from 1; it tells how the object is lost,
                one clause, which ends the phase; else None.
            steps: How many.
            goal: Where the object shall be in the palm at the end, shape (4, 4); by default where it was
                after the squeeze.
        """
        if goal is not None:
            self._reference = goal
        self._slip.begin_phase()
        lost = None
        for k in range(1, steps + 1):
            lost = drive(k)
            if lost is not None:
                break
            self.control.drive(self._goal(), 1.0, 1.0)
            self._stage.step()
            if k % self._look == 0:
                self._slip.look()
                self._response.feel(self._slip.slip_m)
        return self._judge(name, 1.0, lifted=True, lost=lost)

    @property
    def slips_m(self) -> FloatArray:
        """Net sliding of each finger, at the contact where it slid farthest, shape (n,)."""
        return self._slip.slips_m

    def begin_contact(self, contact: int) -> None:
        """Let a finger's contact end: it takes another one."""
        self._slip.begin_contact(contact)

    def push(self, direction: FloatArray) -> float:
        """Push harder and harder until a contact slides; return the push resisted, in weights.

        Afterwards everything is as before.
        """
        p, body = self._stage.parameters, self._stage.world.object_model
        weight_n = body.mass_kg * self._stage.world.scene.gravity

        def apply(share: float) -> None:
            pybullet.applyExternalForce(
                self._stage.world.object_id,
                -1,
                (share * p.push_limit * weight_n * direction).tolist(),
                self._stage.world.object_pose()[:3, 3].tolist(),
                pybullet.WORLD_FRAME,
                physicsClientId=self._stage.world.client,
            )

        return p.push_limit * self._resisted(apply, lambda slip_m, _: slip_m > p.push_slip_m)

    def twist(self, axis: FloatArray) -> float:
        """Turn the object harder and harder about an axis till it gives way; return the torque resisted, N m.

        Afterwards everything is as before.
        """
        p = self._stage.parameters

        def apply(share: float) -> None:
            pybullet.applyExternalTorque(
                self._stage.world.object_id,
                -1,
                (share * p.twist_limit_nm * axis).tolist(),
                pybullet.WORLD_FRAME,
                physicsClientId=self._stage.world.client,
            )

        return p.twist_limit_nm * self._resisted(
            apply, lambda slip_m, turned_deg: slip_m > p.push_slip_m or turned_deg > p.twist_slip_deg
        )

    def _resisted(self, apply: Callable[[float], None], gives_way: Callable[[float, float], bool]) -> float:
        """Return the share of a growing disturbance that is resisted; afterwards everything is as before.

        Args:
            apply: Applies a share of the disturbance, 0 to 1, for the next step.
            gives_way: Whether the largest sliding at a contact, m, and the object's turn, deg, are too much.
        """
        stage, p = self._stage, self._stage.parameters
        client = stage.world.client
        saved = pybullet.saveState(physicsClientId=client)
        before, slip = self.object_in_palm(), SlipMeter(stage.hand, self._fingers, p.contact_force_n)
        slip.look()
        memory = self.control.memory()
        firmness_n, response = self.control.mean_force_n, self._new_response()
        steps = self._steps(p.push_time_s)
        resisted = 0.0
        for k in range(1, steps + 1):
            apply(k / steps)
            self.control.drive(self._goal(), 1.0, 1.0)
            pybullet.stepSimulation(physicsClientId=client)
            if k % self._look == 0:
                slip.look()
                response.feel(slip.slip_m)
                now = self.object_in_palm()
                drift = np.linalg.norm(now[:3, 3] - before[:3, 3])
                if gives_way(slip.slip_m, turn_deg(before, now)) or drift > p.slip_limit_m:
                    break
                resisted = k / steps
        pybullet.restoreState(stateId=saved, physicsClientId=client)
        pybullet.removeState(saved, physicsClientId=client)
        self.control.recall(memory)
        if self.control.mean_force_n != firmness_n:
            self.control.mean_force_n = firmness_n
            self.control.distribute()
        return resisted

    def _new_response(self) -> SlipResponse:
        p = self._stage.parameters
        return SlipResponse(self.control, p.slip_response, p.slip_force_limit_n)

    def _goal(self) -> FloatArray:
        """Return where the palm shall be in the world after the next step, shape (4, 4)."""
        return self._stage.carried(self.palm, self._stage.time_step_s)

    def _steps(self, time_s: float) -> int:
        return max(1, round(time_s / self._stage.time_step_s))

    def object_in_palm(self) -> FloatArray:
        """Return transform_object_to_palm, shape (4, 4)."""
        pose: FloatArray = np.linalg.inv(self._stage.hand.palm_pose()) @ self._stage.world.object_pose()
        return pose

    def _largest_load(self, centres: FloatArray) -> float:
        """Return the largest force that carries a rigidly held object along, in weights, shape (t, 3)."""
        gravity = self._stage.world.scene.gravity
        acceleration = np.diff(centres, 2, axis=0) / self._stage.time_step_s**2 + [0.0, 0.0, gravity]
        return float(np.linalg.norm(acceleration, axis=1).max(initial=gravity) / gravity)

    def _judge(self, name: str, load_weight: float, *, lifted: bool, lost: str | None = None) -> bool:
        now, p = self.object_in_palm(), self._stage.parameters
        contacts = sum(touch is not None for touch in self.control.touches())
        drift = float(np.linalg.norm(now[:3, 3] - self._reference[:3, 3]))
        height = self._stage.world.object_pose()[2, 3] - self._ground
        if lifted and height < 0.5 * p.lift_height_m:
            self.reason = f"the object was dropped in phase {name}"
        elif lost is not None:
            self.reason = f"{lost} in phase {name}"
        elif contacts < 2:
            self.reason = f"only {contacts} finger(s) held on in phase {name}"
        elif drift > p.slip_limit_m:
            self.reason = f"the object slipped {1e3 * drift:.0f} mm in phase {name}"
        held = self.reason is None
        self.phases.append(
            PhaseOutcome(
                name=name,
                contacts=contacts,
                contacts_lost=self._slip.contacts_lost,
                slip_m=self._slip.slip_m,
                drift_m=drift,
                turn_deg=turn_deg(self._reference, now),
                load_weight=load_weight,
                held=held,
            )
        )
        return held
