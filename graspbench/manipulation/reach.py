"""How far a grasp can move its object: until a limit, an edge or a singularity is met."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.manipulation.clik import Clik, ClikParameters, Lead
from graspbench.manipulation.held_object import HeldObject
from graspbench.manipulation.loop import ClikHistory, simulate
from graspbench.manipulation.motion import MotionParameters, object_motion, quintic
from graspbench.manipulation.secondary_task import build_tasks

POSITION_TOLERANCE_M = 1e-4
"""How far the object may be off its path in a motion that succeeds."""
ROTATION_TOLERANCE_DEG = 0.1
"""How far it may be turned off."""
JOINT_TOLERANCE_DEG = 0.05
"""How far a joint may be beyond its limit."""

MAX_TRANSLATION_M = 0.05
"""How far a range is looked for."""
MAX_ROTATION_DEG = 60.0
_RANGE_DURATION_S = 10.0
_RANGE_STEP_S = 5e-3

Watch = Callable[[Clik, int], None]


@dataclass(frozen=True)
class Reach:
    """How far a motion can be followed.

    Attributes:
        share: Of the way to the motion's farthest pose, 0 to 1.
        translation_m: That share of the translation, shape (3,).
        rotation_deg: That share of the rotation vector, shape (3,).
        time_s: When the motion ends; its whole duration if nothing ends it.
        ended_by: What ends it, None if nothing does.
    """

    share: float
    translation_m: FloatArray
    rotation_deg: FloatArray
    time_s: float
    ended_by: str | None


@dataclass(frozen=True)
class RangeEntry:
    """How far a grasp can move its object in one direction.

    Attributes:
        direction: "+x" to "-z" in palm axes.
        kind: "translation" or "rotation".
        reach: m or deg; at most `MAX_TRANSLATION_M` or `MAX_ROTATION_DEG`, where the search stops.
        ended_by: What ends the motion, None if the search's end does.
    """

    direction: str
    kind: str
    reach: float
    ended_by: str | None


class _EndOfReach(ManipulationError):
    """The motion cannot be followed any farther."""


def follow(
    held: HeldObject,
    motion: MotionParameters,
    clik: ClikParameters,
    *,
    lead: Lead | None = None,
    watch: Watch | None = None,
) -> tuple[Reach, ClikHistory | None]:
    """Move the object until the motion ends or cannot be followed.

    The motion ends where the object is off its path, a joint is beyond its limit, a contact is at the edge of
    its chart, or the inverse kinematics cannot go on.

    Args:
        held: Where it starts.
        motion: What the object shall do.
        clik: Inverse kinematics and secondary tasks.
        lead: How contacts are led over the surface, see `Clik`.
        watch: Called in every period, see `simulate`.

    Returns:
        How far it goes, and the motion if it goes all the way.
    """
    reference = object_motion(motion, held.position, held.rotation)
    law = Clik(held.system, reference, clik, build_tasks(clik.tasks), lead=lead)
    now = 0.0

    def check(law: Clik, period: int) -> None:
        nonlocal now
        now = period * clik.step_s
        ended_by = _shortfall(law, held.joint_names)
        if ended_by is not None:
            raise _EndOfReach(ended_by)
        if watch is not None:
            watch(law, period)

    try:
        history = simulate(law, held.joints, held.variables, motion.duration_s, watch=check)
    except ManipulationError as error:
        return _reach(motion, max(now - clik.step_s, 0.0), error.what), None
    return _reach(motion, motion.duration_s, None), history


def reachable_range(held: HeldObject, clik: ClikParameters) -> tuple[RangeEntry, ...]:
    """Return how far the object can be moved and turned along and about each palm axis, both ways.

    The motions take 10 s to `MAX_TRANSLATION_M` or `MAX_ROTATION_DEG`; slower ones may go farther.

    Args:
        held: Where it starts.
        clik: Inverse kinematics and secondary tasks; its period is lengthened where that is safe.
    """
    step_s = max(clik.step_s, _RANGE_STEP_S) if clik.method == "pseudo_inverse" else clik.step_s
    settings = replace(clik, step_s=step_s)
    entries = []
    for kind, largest in (("translation", MAX_TRANSLATION_M), ("rotation", MAX_ROTATION_DEG)):
        for axis in range(3):
            for sign in (1.0, -1.0):
                still, way = np.zeros(3), sign * largest * np.eye(3)[axis]
                motion = MotionParameters(
                    name="range",
                    translation_m=_triple(way if kind == "translation" else still),
                    rotation_deg=_triple(way if kind == "rotation" else still),
                    duration_s=_RANGE_DURATION_S,
                    there_and_back=False,
                )
                reach, _ = follow(held, motion, settings)
                direction = ("+" if sign > 0 else "-") + "xyz"[axis]
                entries.append(RangeEntry(direction, kind, largest * reach.share, reach.ended_by))
    return tuple(entries)


def refusal(reach: Reach, way_m: FloatArray | None = None) -> ManipulationError:
    """Return the error that refuses a motion, with how far the grasp can go.

    Args:
        reach: How far.
        way_m: Way of the contacts that were to slide meanwhile, palm frame, shape (3,); None without any.
    """
    moved = ", ".join(f"{v:.4f}" for v in reach.translation_m)
    turned = ", ".join(f"{v:.1f}" for v in reach.rotation_deg)
    slid, other = "", "use another contact"
    if way_m is not None:
        other = "let other fingers slide (contact.sliding.fingers)"
        if np.any(way_m):
            slid = f" contact.sliding.way_m=[{', '.join(f'{v:.4f}' for v in reach.share * way_m)}]"
    if reach.share >= 1.0:
        return ManipulationError(
            f"the grasp can follow the motion there but not back: at {reach.time_s:.2f} s {reach.ended_by}",
            remedy=f"set motion.there_and_back=false, or {other}",
            reach=reach,
        )
    return ManipulationError(
        f"the grasp can follow only {100.0 * reach.share:.0f} % of the motion, then {reach.ended_by}",
        remedy=f"ask for at most motion.translation_m=[{moved}] motion.rotation_deg=[{turned}]{slid}, "
        f"or {other}",
        reach=reach,
    )


def _shortfall(law: Clik, joint_names: Sequence[str]) -> str | None:
    """Return what is wrong with the law's state, or None."""
    errors, system = law.errors, law.system
    far_m = float(np.linalg.norm(errors[:, :3], axis=1).max())
    turned_deg = float(np.rad2deg(np.linalg.norm(errors[:, 3:], axis=1).max()))
    if far_m > POSITION_TOLERANCE_M or turned_deg > ROTATION_TOLERANCE_DEG:
        return f"the object is {1e3 * far_m:.2g} mm and {turned_deg:.2g} deg off its path"
    joints = law.state.joints
    beyond = np.rad2deg(np.maximum(joints - system.tree.upper, system.tree.lower - joints))
    joint = int(np.argmax(beyond))
    if beyond[joint] > JOINT_TOLERANCE_DEG:
        return f"joint {joint_names[joint]} is {beyond[joint]:.2g} deg beyond its limit"
    return None


def _triple(vector: FloatArray) -> tuple[float, float, float]:
    x, y, z = vector
    return float(x), float(y), float(z)


def _reach(motion: MotionParameters, time_s: float, ended_by: str | None) -> Reach:
    there_s = 0.5 * motion.duration_s if motion.there_and_back else motion.duration_s
    share = 1.0 if ended_by is None else float(quintic(time_s / there_s)[0])
    # what is said to be reachable is rounded down to whole percents
    share = np.floor(100.0 * share) / 100.0
    return Reach(
        float(share),
        share * np.array(motion.translation_m),
        share * np.array(motion.rotation_deg),
        time_s,
        ended_by,
    )
