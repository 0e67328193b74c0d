"""How far the object slides under the fingertips, and which of them lose touch."""

from collections.abc import Sequence

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.simulated_hand import SimulatedHand
from graspbench.simulation.touch import Touch


class SlipMeter:
    """Sums up the sliding at each contact while the object is held.

    Between two looks a contact point is carried along once by the object and once by the fingertip; the part
    of the difference along the surface is sliding. A contact that rolls carries both alike. The sum is kept
    in the object's frame, so that trembling cancels out.

    Args:
        hand: The hand, with the object in its world.
        fingers: The fingers to watch.
        contact_force_n: Least normal force that counts as touch.

    Attributes:
        contacts_lost: Most fingers out of touch at a look, since the last `begin_phase`.
    """

    def __init__(self, hand: SimulatedHand, fingers: tuple[int, ...], contact_force_n: float) -> None:
        self._hand, self._fingers, self._contact_force_n = hand, fingers, contact_force_n
        self._sums, self._worst_m = np.zeros((len(fingers), 3)), np.zeros(len(fingers))
        self._before: tuple[Sequence[Touch | None], FloatArray, FloatArray] | None = None
        self.contacts_lost = 0

    @property
    def slip_m(self) -> float:
        """Net sliding of the contact that slid farthest."""
        return float(self.slips_m.max())

    @property
    def slips_m(self) -> FloatArray:
        """Net sliding of each contact, the farthest of all that a finger has had, shape (n,)."""
        slips: FloatArray = np.maximum(self._worst_m, np.linalg.norm(self._sums, axis=1))
        return slips

    def begin_contact(self, contact: int) -> None:
        """Sum the sliding of a contact anew: its finger goes elsewhere."""
        self._worst_m, self._sums[contact] = self.slips_m, 0.0

    def begin_phase(self) -> None:
        """Count lost contacts anew."""
        self.contacts_lost = 0

    def look(self) -> None:
        """Add the sliding since the last look."""
        hand = self._hand
        found = hand.touches(self._contact_force_n)
        touches = [found[f] for f in self._fingers]
        object_pose, tip_poses = hand.world.object_pose(), hand.tip_poses(self._fingers)
        self.contacts_lost = max(self.contacts_lost, sum(touch is None for touch in touches))
        if self._before is not None:
            then, object_then, tips_then = self._before
            for i, (touch, now) in enumerate(zip(then, touches, strict=True)):
                if touch is not None and now is not None:
                    on_object = _carried(touch.point, object_then, object_pose)
                    on_tip = _carried(touch.point, tips_then[i], tip_poses[i])
                    slid = on_object - on_tip
                    slid -= (slid @ touch.normal) * touch.normal
                    self._sums[i] += object_pose[:3, :3].T @ slid
        self._before = touches, object_pose, tip_poses


def _carried(point: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
    """Return where a point fixed to a body goes when the body moves between two poses, shape (4, 4)."""
    moved: FloatArray = after[:3, :3] @ (before[:3, :3].T @ (point - before[:3, 3])) + after[:3, 3]
    return moved
