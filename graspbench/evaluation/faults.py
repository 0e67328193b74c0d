"""What may be wrong with a file of grasps, found by evidence: limits, and tips that are off the object.

A file says nothing of how it was meant. But of a grasp the fingertips are at the object and the joints within
their limits, and next to nothing is so by chance: a file whose tips are far off as it is read, and near when
it is read in a way that writers are known to err in, was written in that way.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from graspbench.arrays import FloatArray
from graspbench.errors import GraspbenchError
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FORMATS, FormatContext
from graspbench.evaluation.formats.hand_layout import hand_layout
from graspbench.evaluation.formats.reading import AS_STATED, Reading
from graspbench.evaluation.grasp_record import GraspRecord, HandPose
from graspbench.hand.model import HandModel

READINGS = {
    "xyzw": Reading(quaternion="xyzw"),
    "degrees": Reading(radians_per_unit=float(np.pi / 180.0)),
    "millimetres": Reading(metres_per_unit=1e-3),
}
"""Ways to read a file that its writer may have meant, by name."""

_MEANT = {
    "xyzw": "its quaternions as xyzw instead of wxyz",
    "degrees": "its joints in degrees instead of radians",
    "millimetres": "its positions in millimetres instead of metres",
    "joint_order": "its joints in another order",
    "mirrored_hand": "the mirrored hand",
}

_MAX_LOOKED_AT = 40
_SAMPLES = 20_000
_FINE_M = 0.003
_OUTSIDE_RAD = 0.02
_MAX_OUTSIDE = 0.02
_SHARE = 0.5
_FAR_SHARE = 0.1
_MAX_BLOCKS = 5


@dataclass(frozen=True)
class Fault:
    """What is wrong with a file.

    Attributes:
        kinds: xyzw, degrees, millimetres (several may be at once), joint_order or mirrored_hand.
        sentence: What it seems to be, and by what evidence.
        as_read_m: How far fingertips are off the object's surface as the file is read, the median.
        as_meant_m: The same as it seems to be meant.
    """

    kinds: tuple[str, ...]
    sentence: str
    as_read_m: float
    as_meant_m: float


@dataclass(frozen=True)
class _Evidence:
    off_m: float
    outside: float

    @property
    def speaks_for(self) -> bool:
        return self.off_m <= _FINE_M and self.outside <= _MAX_OUTSIDE

    def beats(self, other: "_Evidence") -> bool:
        """Tell whether this reading is so much better that the other was not meant."""
        near = self.off_m <= max(_FINE_M, _FAR_SHARE * other.off_m)
        nearer = near and self.off_m < _SHARE * other.off_m and self.outside <= other.outside + 1e-9
        rightful = self.outside <= _MAX_OUTSIDE < other.outside and self.off_m <= 1.1 * other.off_m
        return nearer or rightful


def combined_reading(names: Sequence[str]) -> Reading:
    """Return a way to read a file from the names of what differs.

    Raises:
        GraspFileError: There is no such name.
    """
    reading = AS_STATED
    for name in names:
        if name not in READINGS:
            raise GraspFileError(
                f"a file cannot be read as '{name}'", remedy=f"choose from {', '.join(READINGS)}"
            )
        changes = {
            key: value for key, value in vars(READINGS[name]).items() if value != getattr(AS_STATED, key)
        }
        reading = replace(reading, **changes)
    return reading


def find_fault(path: Path, records: Sequence[GraspRecord], context: FormatContext, name: str) -> Fault | None:
    """Return what is wrong with a file, if the evidence is clear.

    Args:
        path: The file.
        records: What it was read as.
        context: What it was read for.
        name: Its format.
    """
    with_hand = [record for record in records if record.grasp is not None]
    if not with_hand:
        return None
    looked_at = with_hand[:: max(1, len(with_hand) // _MAX_LOOKED_AT)][:_MAX_LOOKED_AT]
    gauge = _Gauge(context)
    as_read = gauge.evidence(looked_at)
    if as_read.speaks_for:
        return None
    best: tuple[tuple[str, ...], _Evidence] | None = None
    for kinds, evidence in (
        *_other_readings(path, context, name, gauge, len(records)),
        *((("joint_order",), gauge.evidence(each)) for each in _other_orders(looked_at, context.hand, name)),
        *((("mirrored_hand",), each) for each in gauge.mirrored(looked_at)),
    ):
        if evidence.beats(as_read) and (best is None or evidence.off_m < _SHARE * best[1].off_m):
            best = kinds, evidence
    if best is None:
        return None
    kinds, evidence = best
    meant = " and ".join(_MEANT[kind] for kind in kinds)
    sentence = (
        f"{path} seems to have {meant}: its fingertips are {1e3 * as_read.off_m:.1f} mm off the object as it "
        f"is read and {1e3 * evidence.off_m:.1f} mm so (median of {len(looked_at)} grasps)"
    )
    if as_read.outside > _MAX_OUTSIDE:
        sentence += f", and {100 * as_read.outside:.0f} % of its joints are outside their limits"
    return Fault(kinds, sentence, as_read.off_m, evidence.off_m)


def refuse_fault(fault: Fault, name: str) -> GraspFileError:
    """Return the error that says what is wrong with a file, and what to do."""
    if set(fault.kinds) <= set(READINGS):
        remedy = f"correct it, or say --read-as {','.join(fault.kinds)}"
    elif fault.kinds == ("joint_order",):
        remedy = f"state their order with hand.formats.{name}.joints"
    else:
        remedy = "choose the other hand with --hand"
    return GraspFileError(fault.sentence, remedy=f"{remedy}; --as-it-is if it is meant so", kinds=fault.kinds)


class _Gauge:
    """Measures how far fingertips are off an object."""

    def __init__(self, context: FormatContext) -> None:
        self._hand, self._scale = context.hand, context.object_scale
        points, _ = trimesh.sample.sample_surface(context.object_model.mesh, _SAMPLES, seed=0)
        self._tree = cKDTree(np.asarray(points))

    def evidence(self, records: Sequence[GraspRecord]) -> _Evidence:
        """Return how far tips are off, and which share of the joints is outside of limits."""
        joints = np.stack([_grasp(record).joints for record in records])
        beyond = np.maximum(self._hand.lower - joints, joints - self._hand.upper) > _OUTSIDE_RAD
        tips = np.stack([self._hand.tip_positions(row) for row in joints])
        return _Evidence(self._off_m(records, tips), float(beyond.mean()))

    def mirrored(self, records: Sequence[GraspRecord]) -> Iterator[_Evidence]:
        """Yield the evidence for hands mirrored in a plane through the palm's axis."""
        hand = self._hand
        spread = hand.upper - hand.lower
        # Joints that bend to either side alike turn the other way in some mirrored hands.
        sideways = np.where(np.abs(hand.upper + hand.lower) < 0.1 * spread, -1.0, 1.0)
        joints = np.stack([_grasp(record).joints for record in records])
        outside = self.evidence(records).outside
        for signs, axis in product((np.ones(hand.n_joints), sideways), (0, 1)):
            tips = np.stack([hand.tip_positions(row) for row in signs * joints])
            tips[..., axis] *= -1.0
            yield _Evidence(self._off_m(records, tips), outside)

    def _off_m(self, records: Sequence[GraspRecord], tips: FloatArray) -> float:
        """Return how far tips are off, palm frame, shape (n, n_f, 3): the median over grasps.

        Of each grasp it is the upper quartile over fingers: one of several may be meant to stay away.
        """
        palms = np.stack([_grasp(record).transform_palm_to_object for record in records])
        # The gauge is of one size; grasps of other sizes are brought to it.
        sizes = np.array([self._scale / record.object_scale for record in records])[:, None]
        centres = np.einsum("nij,nfj->nfi", palms[:, :3, :3], tips) + palms[:, None, :3, 3]
        distances, _ = self._tree.query(centres * sizes[..., None])
        off = np.abs(distances / sizes - self._hand.tip_radius_m)
        return float(np.median(np.quantile(off, 0.75, axis=1)))


def _grasp(record: GraspRecord) -> HandPose:
    assert record.grasp is not None, "only grasps with a hand are looked at"
    return record.grasp


def _other_readings(
    path: Path, context: FormatContext, name: str, gauge: _Gauge, count: int
) -> Iterator[tuple[tuple[str, ...], _Evidence]]:
    """Yield what the file would be if its quaternions or units were others."""
    for chosen in product((False, True), repeat=len(READINGS)):
        kinds = tuple(kind for kind, taken in zip(READINGS, chosen, strict=True) if taken)
        if not kinds:
            continue
        try:
            reread = FORMATS[name].read(path, replace(context, reading=combined_reading(kinds)))
        except GraspbenchError:
            continue
        found = [record for record in reread if record.grasp is not None]
        yield kinds, gauge.evidence(found[:: max(1, count // _MAX_LOOKED_AT)][:_MAX_LOOKED_AT])


def _other_orders(records: Sequence[GraspRecord], hand: HandModel, name: str) -> Iterator[list[GraspRecord]]:
    """Yield the grasps with their joints in other orders that a writer may have had."""
    stated = [hand.joint_names[i] for i in hand_layout(hand, name).to_hand]
    at = {joint: i for i, joint in enumerate(hand.joint_names)}
    seen = {tuple(stated)}
    for order in _orders(hand, stated):
        if order in seen or set(order) != set(stated):
            continue
        seen.add(order)
        source = np.arange(hand.n_joints)
        for joint in stated:
            # What was meant for this joint stands where the writer had it.
            source[at[joint]] = at[stated[order.index(joint)]]
        yield [
            replace(record, grasp=replace(_grasp(record), joints=_grasp(record).joints[source]))
            for record in records
        ]


def _orders(hand: HandModel, stated: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Yield orders of joints: sorted by name, as the description has them, finger by finger in any order."""
    yield hand.joint_names
    yield tuple(sorted(stated))
    yield tuple(sorted(stated, key=_natural))
    yield tuple(reversed(stated))
    blocks = _fingers(hand, stated)
    each_way: tuple[Callable[[tuple[str, ...]], tuple[str, ...]], ...] = (lambda b: b, lambda b: b[::-1])
    if len(blocks) > _MAX_BLOCKS:
        return
    for chosen in permutations(blocks):
        for turned in each_way:
            yield tuple(joint for block in chosen for joint in turned(block))
    longest = max(len(block) for block in blocks)
    yield tuple(block[i] for i in range(longest) for block in blocks if i < len(block))


def _fingers(hand: HandModel, stated: Sequence[str]) -> list[tuple[str, ...]]:
    blocks = [tuple(hand.joint_names[i] for i in hand.finger_joints(f)) for f in range(hand.n_fingers)]
    held = {joint for block in blocks for joint in block}
    rest = tuple(joint for joint in stated if joint not in held)
    return [*blocks, rest] if rest else blocks


def _natural(name: str) -> tuple[tuple[int, str], ...]:
    return tuple((int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", name))
