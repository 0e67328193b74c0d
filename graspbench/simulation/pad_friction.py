"""Soft pads in the physics: the torque that a contact bears follows its load."""

from graspbench.simulation.stage import Stage

_PERIOD_S = 0.01


class PadFriction:
    """Sets each finger's torsional friction to what its pad bears under the normal force that is felt.

    Bullet bounds force and torque of a contact apart from each other: what the limit surface, an ellipsoid,
    leaves out of the cylinder around it is not taken away.

    Args:
        stage: Hand and object; contacts that are no soft pads are left as they are.
        fingers: The fingers that touch.
    """

    def __init__(self, stage: Stage, fingers: tuple[int, ...]) -> None:
        self._stage, self._fingers = stage, fingers
        self._every = max(1, round(_PERIOD_S / stage.time_step_s))
        self._age = 0

    def follow_load(self) -> None:
        """Renew the friction, if it is due; call once a time step."""
        friction = self._stage.friction
        if friction.pad is None:
            return
        if self._age % self._every == 0:
            touches = self._stage.hand.touches(self._stage.parameters.contact_force_n)
            for finger in self._fingers:
                touch = touches[finger]
                if touch is not None:
                    torsion_m = friction.pad.torsion_m(touch.force_n, friction.coulomb)
                    self._stage.hand.set_torsion(finger, torsion_m)
        self._age += 1
