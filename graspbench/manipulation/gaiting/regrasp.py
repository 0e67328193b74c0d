"""A round of steps: one finger after the other goes to where it can stand during the next turn."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand import HandModel
from graspbench.manipulation.charts import Chart, ChartPoint
from graspbench.manipulation.gaiting.finger_step import FingerStep, Stepping, touch_down
from graspbench.manipulation.gaiting.footholds import Foothold, Footholds
from graspbench.manipulation.gaiting.hold import HoldTest
from graspbench.manipulation.gaiting.turning import Turning

ChartAt = Callable[[FloatArray, FloatArray], Chart]
"""The chart around a point of the surface with its outward normal, object frame."""

_MAX_TRIALS = 300
_TIP_GAP_M = 2e-3


@dataclass(frozen=True, eq=False)
class Stand:
    """How the fingers stand on the object at rest.

    Attributes:
        points: Contacts, object frame, shape (n_c, 3), m.
        normals: Outward unit normals, shape (n_c, 3).
        joints: Of the whole hand, shape (n_q,), rad.
    """

    points: FloatArray
    normals: FloatArray
    joints: FloatArray


@dataclass(frozen=True, eq=False)
class Placement:
    """A step that puts a contact elsewhere.

    Attributes:
        contact: Which contact of the grasp.
        chart: The surface around the new one.
        way: The finger's way there.
    """

    contact: int
    chart: Chart
    way: FingerStep


@dataclass
class _Search:
    """What one search shares: where fingers may go, how much it has looked at, and if a turn follows."""

    turned_deg: float
    places: list[list[Foothold]]
    final: bool
    trials: int = 0
    hopeless: set[tuple[int, int, bytes]] = field(default_factory=set)


class Regrasp:
    """Finds rounds of steps.

    Args:
        hand: The hand.
        fingers: The finger of each contact.
        footholds: Where fingers can stand.
        stepping: Their ways.
        hold: Which contacts hold the object.
        chart_at: Makes charts around new contacts.
        turning: How the object turns in the palm.
    """

    def __init__(
        self,
        hand: HandModel,
        fingers: tuple[int, ...],
        footholds: Footholds,
        stepping: Stepping,
        hold: HoldTest,
        chart_at: ChartAt,
        turning: Turning,
    ) -> None:
        self._hand, self._fingers = hand, fingers
        self._footholds, self._stepping, self._hold = footholds, stepping, hold
        self._chart_at, self._turning = chart_at, turning
        self._charts: dict[int, Chart] = {}

    def find(
        self, stand: Stand, turned_deg: float, until_deg: float, *, final: bool, may_stay: bool
    ) -> list[Placement] | None:
        """Return steps after which all fingers can stand until a turn, None if none were found.

        Args:
            stand: The fingers now.
            turned_deg: How far the object has turned.
            until_deg: How far it shall turn with the new contacts.
            may_stay: Whether fingers may stay where they stand, if that will do.
            final: Whether no further round follows, for which some finger has to be free to step.
        """
        places = [
            self._places(stand, i, turned_deg, until_deg, may_stay=may_stay)
            for i in range(len(self._fingers))
        ]
        if not all(places):
            return None
        search = _Search(turned_deg, places, final)
        return self._go_on(search, stand, frozenset(range(len(self._fingers))))

    def _places(
        self, stand: Stand, contact: int, first_deg: float, last_deg: float, *, may_stay: bool
    ) -> list[Foothold]:
        """Return where a finger may go, where it stands already among them if that will do."""
        finger = self._fingers[contact]
        start = stand.joints[self._hand.finger_joints(finger)]
        here = Foothold(-1, stand.points[contact], stand.normals[contact], start, -np.inf)
        places = self._footholds.over(finger, start, first_deg, last_deg)
        if may_stay and self._footholds.stays(finger, here, first_deg, last_deg):
            # a step saved is worth a little
            return [here, *places]
        return places

    def _go_on(self, search: _Search, stand: Stand, waiting: frozenset[int]) -> list[Placement] | None:
        """Return the steps of the fingers that wait, none left out."""
        if not waiting:
            return [] if self._ends_well(search, stand) else None
        for contact in sorted(waiting, key=lambda i: (search.places[i][0].node >= 0, i)):
            others = waiting - {contact}
            if search.places[contact][0].node < 0:
                found = self._go_on(search, stand, others)
                if found is not None:
                    return found
            if not self._hold.without(stand.points, stand.normals, contact):
                continue
            for place in search.places[contact]:
                if place.node < 0 or search.trials >= _MAX_TRIALS:
                    continue
                search.trials += 1
                after = self._placed(search, stand, contact, place)
                if after is None:
                    continue
                placed, step = after
                found = self._go_on(search, placed, others)
                if found is not None:
                    return [step, *found]
        return None

    def _ends_well(self, search: _Search, stand: Stand) -> bool:
        if not self._hold(stand.points, stand.normals):
            return False
        n = len(self._fingers)
        return search.final or any(self._hold.without(stand.points, stand.normals, i) for i in range(n))

    def _placed(
        self, search: _Search, stand: Stand, contact: int, place: Foothold
    ) -> tuple[Stand, Placement] | None:
        """Return the stand after a step, None if it cannot be taken."""
        key = (contact, place.node, stand.points.tobytes())
        if key in search.hopeless:
            return None
        points, normals = stand.points.copy(), stand.normals.copy()
        chart = self._chart(place)
        at = chart((0.0, 0.0))
        points[contact], normals[contact] = at.point, at.frame[:, 2]
        way = None
        if self._apart(points, normals, contact) and self._hold(points, normals):
            way = self._way(search.turned_deg, stand, contact, place, at)
        if way is None:
            search.hopeless.add(key)
            return None
        after = replace(stand, points=points, normals=normals, joints=way.joints[-1])
        return after, Placement(contact, chart, way)

    def _chart(self, place: Foothold) -> Chart:
        if place.node not in self._charts:
            self._charts[place.node] = self._chart_at(place.point, place.normal)
        return self._charts[place.node]

    def _way(
        self, turned_deg: float, stand: Stand, contact: int, place: Foothold, at: ChartPoint
    ) -> FingerStep | None:
        """Return the way of a finger onto a chart, which it meets exactly; None if there is none."""
        finger, pose = self._fingers[contact], self._turning.pose(turned_deg)
        centre = at.point + self._hand.tip_radius_m * at.frame[:, 2]
        goal = touch_down(self._hand, finger, place.joints, pose[:3, :3] @ centre + pose[:3, 3])
        if goal is None:
            return None
        holding = tuple(f for f in self._fingers if f != finger)
        leaving = stand.normals[contact], at.frame[:, 2]
        return self._stepping.step(finger, stand.joints, goal, leaving, turned_deg, holding)

    def _apart(self, points: FloatArray, normals: FloatArray, contact: int) -> bool:
        centres = points + self._hand.tip_radius_m * normals
        gaps = np.linalg.norm(np.delete(centres, contact, axis=0) - centres[contact], axis=1)
        return bool(gaps.min() >= 2.0 * self._hand.tip_radius_m + _TIP_GAP_M)
