"""Finger gaiting: turns as far as the grasp allows, and rounds of steps between them.

All fingers turn the object about the grasp's normal (closed-loop inverse kinematics, the contacts as passive
joints) until a joint, a link, a chart, a singularity or the friction ends it. Then the fingers step backwards
over the surface one by one, while the others hold the object at rest, and the next turn begins. Everything is
planned before the first motion, so a gait that cannot be done is refused before it starts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.grasp.configuration import Grasp
from graspbench.hand import HandModel
from graspbench.manipulation.charts import Chart, mesh_patch
from graspbench.manipulation.clik import ClikParameters
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.gaiting.finger_step import Stepping
from graspbench.manipulation.gaiting.footholds import Footholds
from graspbench.manipulation.gaiting.gait_parameters import GAITING, GaitParameters
from graspbench.manipulation.gaiting.gait_result import GaitResult, Piece, join
from graspbench.manipulation.gaiting.hold import HoldTest
from graspbench.manipulation.gaiting.regrasp import ChartAt, Placement, Regrasp
from graspbench.manipulation.gaiting.stance import Moves, Stance
from graspbench.manipulation.gaiting.turning import Turning, grasp_normal
from graspbench.manipulation.held_object import hold_object, refuse_links
from graspbench.reconstruction.surface import Surface

_SHARES = (1.0, 0.7, 0.4)
"""Of a turn, after which a round of steps is looked for."""
_GOALS_DEG = 10.0
_LEAST_GOAL_DEG = 10.0
_ENOUGH = 0.6
"""Of the turn that steps are made for, so much has to be possible after them."""
_MAX_ROUNDS = 80
_NEARLY_DEG = 1e-6


def gait_object(
    hand: HandModel,
    grasp: Grasp,
    surface: Surface,
    gait: GaitParameters,
    clik: ClikParameters,
    contact: ContactParameters | None = None,
    *,
    gravity: float = 9.81,
    chart_at: ChartAt | None = None,
) -> GaitResult:
    """Turn a grasped object about the grasp's normal by finger gaiting; the palm stays.

    Args:
        hand: The hand.
        grasp: Grasp with the hand's posture, its contacts in the world.
        surface: The object's surface in the world, on whose nodes the fingers can stand.
        gait: How far, and how.
        clik: Inverse kinematics and secondary tasks of the turns.
        contact: Contact type and forces.
        gravity: m/s^2.
        chart_at: Makes the charts around contacts from point and outward normal in the object's frame, which
            is at the grasp's centroid with the world's axes; by default fitted to the surface.

    Raises:
        HandError: The grasp has no posture.
        ManipulationError: The fingers cannot turn the object so far; the message says how far they can.
    """
    chosen = contact or ContactParameters()
    _check(hand, grasp, chosen)
    pose = np.eye(4)
    pose[:3, 3] = grasp.centroid
    points = surface.points - grasp.centroid

    def fitted(point: FloatArray, normal: FloatArray) -> Chart:
        return mesh_patch(points, point, normal, radius_m=chosen.patch_radius_m)

    make_chart = chart_at or fitted
    charts = [make_chart(p - grasp.centroid, n) for p, n in zip(grasp.points, grasp.normals, strict=True)]
    held = hold_object(hand, grasp, charts, chosen.kind, transform_object_to_world=pose)
    assert grasp.posture is not None, "hold_object says so"
    contacts = held.system.contacts
    start = Stance(contacts, held.variables[:, :2].copy(), held.joints, 0.0)
    stand = start.stand().points @ held.rotation.T + held.position
    turning = Turning(grasp_normal(stand), held.position, held.rotation)
    height = float((stand.mean(axis=0) - held.position) @ turning.axis)
    footholds = Footholds(hand, surface, pose, turning, height, gait)
    reserved = (1.0 - gait.friction_reserve) * chosen.forces.friction
    sparing = replace(chosen, forces=replace(chosen.forces, friction=reserved))
    stepping = Stepping(hand, footholds.triangles, turning, gait.lift_m)
    fingers = grasp.posture.fingers
    palm = held.transform_palm_to_world
    moves = Moves(hand, fingers, turning, palm, clik, sparing, gait, stepping, gravity)
    hold = HoldTest(chosen.forces.friction, gait.friction_reserve)
    regrasp = Regrasp(hand, fingers, footholds, stepping, hold, make_chart, turning)
    pieces = _Gait(moves, regrasp, gait).pieces(start)
    names = [hand.finger_names[f] for f in fingers]
    return join(pieces, turning.axis, fingers, names, chosen.forces.friction)


def _check(hand: HandModel, grasp: Grasp, contact: ContactParameters) -> None:
    if contact.kind not in GAITING:
        raise ManipulationError(
            f"fingers do not gait on contacts of kind '{contact.kind}'",
            remedy=f"set contact to one of {', '.join(GAITING)}",
        )
    refuse_links(hand)
    if hand.places_by_wrist:
        raise ManipulationError(
            f"the fingers of hand '{hand.name}' cannot place their tips by themselves, so they cannot step",
            remedy="use a hand whose fingers have three or more joints of their own",
        )
    if len(grasp.points) < 3:
        raise ManipulationError(
            "a grasp of two fingers cannot gait: one finger alone does not hold the object",
            remedy="set hand.fingers=4",
        )


@dataclass(frozen=True, eq=False)
class _Reached:
    """How far a gait has come, and the turn that can come next.

    Attributes:
        stance: Where the fingers stand.
        pieces: What led there.
        turned: The next turn and where it leads; None where hardly any is possible.
    """

    stance: Stance
    pieces: tuple[Piece, ...]
    turned: tuple[Stance, Piece] | None


class _Gait:
    """Turn, steps, turn, and so on until the whole angle is done."""

    def __init__(self, moves: Moves, regrasp: Regrasp, gait: GaitParameters) -> None:
        self._moves, self._regrasp, self._gait = moves, regrasp, gait
        self._sign = 1.0 if gait.angle_deg >= 0.0 else -1.0
        self._farthest_deg, self._ended_by = 0.0, ""

    def pieces(self, start: Stance) -> tuple[Piece, ...]:
        now = _Reached(start, (), self._turn(start))
        for _ in range(_MAX_ROUNDS):
            if now.turned is not None and self._left(now.turned[0]) < _NEARLY_DEG:
                return (*now.pieces, now.turned[1])
            after = self._go_on(now)
            if after is None:
                break
            now = after
        raise self._refusal()

    def _left(self, stance: Stance) -> float:
        return abs(self._gait.angle_deg - stance.turned_deg)

    def _turn(self, stance: Stance, share: float = 1.0) -> tuple[Stance, Piece] | None:
        """Turn on as far as can be, or a share of what is asked for at once."""
        asked = share * min(self._left(stance), self._gait.max_turn_deg)
        turned = self._moves.turn(stance, self._sign * asked)
        if turned is not None and abs(turned[0].turned_deg) > self._farthest_deg:
            self._farthest_deg, self._ended_by = abs(turned[0].turned_deg), self._moves.ended_by
        return turned

    def _go_on(self, now: _Reached) -> _Reached | None:
        """Return where a turn leads that steps and another turn can follow, None if none of a few can."""
        tried = set()
        if now.turned is not None:
            whole = abs(now.turned[0].turned_deg - now.stance.turned_deg)
            for share in _SHARES:
                turned = (
                    now.turned if share == 1.0 else self._moves.turn(now.stance, self._sign * share * whole)
                )
                if turned is None or turned[0].turned_deg in tried:
                    continue
                tried.add(turned[0].turned_deg)
                after = self._steps(turned[0], (*now.pieces, turned[1]))
                if after is not None:
                    return after
        if now.pieces:  # the last round left the fingers as well as it could
            return None
        pause = self._moves.pause(now.stance)
        return None if pause is None else self._steps(now.stance, (pause,))

    def _steps(self, stance: Stance, pieces: tuple[Piece, ...]) -> _Reached | None:
        """Return what a round of steps leads to, the next turn as large as can be."""
        left = self._left(stance)
        goal = min(left, self._gait.max_turn_deg)
        while goal > 0.0:
            until, final = stance.turned_deg + self._sign * goal, goal >= left - _NEARLY_DEG
            for may_stay in (True, False):
                stand = stance.stand()
                found = self._regrasp.find(stand, stance.turned_deg, until, final=final, may_stay=may_stay)
                if found is None:  # if no finger may stay there are fewer ways still
                    break
                after = self._taken(stance, pieces, found, goal)
                if after is not None:
                    return after
            if goal <= _LEAST_GOAL_DEG:
                break
            goal = max(goal - _GOALS_DEG, _LEAST_GOAL_DEG)
        return None

    def _taken(
        self, stance: Stance, pieces: tuple[Piece, ...], found: Sequence[Placement], goal_deg: float
    ) -> _Reached | None:
        """Return where steps lead, None if most of the turn that they are for is not possible after them."""
        after, way = stance, list(pieces)
        for placement in found:
            stepped = self._moves.step(after, placement, way[-1])
            if stepped is None:
                return None
            after, piece = stepped
            way.append(piece)
        turned = self._turn(after)
        if turned is None or abs(turned[0].turned_deg - stance.turned_deg) < _ENOUGH * goal_deg:
            return None
        return _Reached(after, tuple(way), turned)

    def _refusal(self) -> ManipulationError:
        whole = np.floor(self._farthest_deg)
        why = f", then {self._ended_by}," if self._ended_by else ""
        return ManipulationError(
            f"the fingers can turn the object only {whole:.0f} of {abs(self._gait.angle_deg):g} deg{why} and "
            "find no next contacts one by one while the others hold the object",
            remedy=f"ask for at most motion.gait.angle_deg={self._sign * whole:.0f}, use more fingers "
            "(hand.fingers), or lower motion.gait.friction_reserve or motion.gait.joint_margin",
            turned_deg=self._farthest_deg,
        )
