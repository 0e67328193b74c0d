"""What may be wrong with a file of grasps, found by evidence: limits, and tips that are off the object.

A file says nothing of how it was meant. But of a grasp the fingertips are at the object and the joints within
their limits, and next to nothing is so by chance: a file whose tips are far off as it is read, and near when
it is read in a way that writers are known to err in, was written in that way.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

from graspbench.arrays import IntArray
from graspbench.errors import GraspbenchError
from graspbench.evaluation.fault_evidence import MAX_OUTSIDE, SHARE, Evidence, Gauge
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FORMATS, FormatContext
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.evaluation.joint_orders import other_orders, reordered
from graspbench.evaluation.other_readings import READINGS, combined_reading

_MEANT = {
    "xyzw": "its quaternions as xyzw instead of wxyz",
    "degrees": "its joints in degrees instead of radians",
    "millimetres": "its positions in millimetres instead of metres",
    "joint_order": "its joints in another order",
    "mirrored_hand": "the mirrored hand",
}

_ORDER, _MIRRORED = "joint_order", "mirrored_hand"
_MAX_LOOKED_AT, _FEW = 40, 8
_EXACT_M = 0.001
_MAX_COMBINED = 3
"""Faults of different kinds that are looked for at once; readings alone are combined without a limit."""


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


Found = tuple[tuple[str, ...], Evidence]
"""Kinds of faults, and the evidence once they are corrected."""


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
    looked_at = _sampled(with_hand, _MAX_LOOKED_AT)
    gauge = Gauge(context)
    as_read = gauge.evidence(looked_at)
    if as_read.speaks_for:
        return None
    best = _best_alone(path, looked_at, context, name, gauge, as_read)
    if best is None or not _explains(best[1]):
        best = _best_together(path, looked_at, context, name, gauge, as_read, best)
    if best is None:
        return None
    kinds, evidence = best
    meant = " and ".join(_MEANT[kind] for kind in kinds)
    sentence = (
        f"{path} seems to have {meant}: its fingertips are {1e3 * as_read.off_m:.1f} mm off the object as it "
        f"is read and {1e3 * evidence.off_m:.1f} mm so (median of {len(looked_at)} grasps)"
    )
    if as_read.outside > MAX_OUTSIDE:
        sentence += f", and {100 * as_read.outside:.0f} % of its joints are outside their limits"
    return Fault(kinds, sentence, as_read.off_m, evidence.off_m)


def refuse_fault(fault: Fault, name: str) -> GraspFileError:
    """Return the error that says what is wrong with a file, and what to do."""
    steps = []
    if readings := [kind for kind in fault.kinds if kind in READINGS]:
        steps.append(f"correct it, or say --read-as {','.join(readings)}")
    if _ORDER in fault.kinds:
        steps.append(f"state their order with hand.formats.{name}.joints")
    if _MIRRORED in fault.kinds:
        steps.append("choose the other hand with --hand")
    remedy = "; and ".join(steps)
    return GraspFileError(fault.sentence, remedy=f"{remedy}; --as-it-is if it is meant so", kinds=fault.kinds)


def _best_alone(
    path: Path,
    looked_at: Sequence[GraspRecord],
    context: FormatContext,
    name: str,
    gauge: Gauge,
    as_read: Evidence,
) -> Found | None:
    """Return what explains a file best among readings, joint orders, and the mirrored hand, each alone."""
    best: Found | None = None
    for kinds, evidence in (
        *(
            (kinds, gauge.evidence(records))
            for kinds, records in _reread(path, context, name, len(looked_at), _MAX_LOOKED_AT)
        ),
        *(
            ((_ORDER,), gauge.evidence(reordered(looked_at, source)))
            for source in other_orders(context.hand, name)
        ),
        *(((_MIRRORED,), each) for each in gauge.mirrored(looked_at)),
    ):
        if evidence.beats(as_read) and (best is None or evidence.off_m < SHARE * best[1].off_m):
            best = kinds, evidence
    return best


def _best_together(
    path: Path,
    looked_at: Sequence[GraspRecord],
    context: FormatContext,
    name: str,
    gauge: Gauge,
    as_read: Evidence,
    alone: Found | None,
) -> Found | None:
    """Return faults of different kinds that explain a file better than one alone, the fewest; or that one.

    So many combinations would fit by chance sooner: they count only where the file is right with them. One
    more has to bring the tips much nearer, too: fingers are alike, and the other hand is nearly this one with
    its fingers in another order.
    """
    orders = list(other_orders(context.hand, name))
    few = _sampled(looked_at, _FEW)
    read: list[tuple[tuple[str, ...], Sequence[GraspRecord]]] = [
        ((), few),
        *_reread(path, context, name, len(few), _FEW),
    ]
    best = alone
    for size in range(2, _MAX_COMBINED + 1):
        found: Found | None = None
        for kinds, records in read:
            for more, evidence in _corrected(records, orders, gauge, size - len(kinds)):
                better = found is None or evidence.off_m < found[1].off_m
                if evidence.speaks_for and evidence.beats(as_read) and better:
                    found = (*kinds, *more), evidence
        if found is not None and (
            best is None or not best[1].speaks_for or found[1].off_m < SHARE * best[1].off_m
        ):
            best = found
        if best is not None and _explains(best[1]):
            break
    return best


def _explains(evidence: Evidence) -> bool:
    """Tell whether nothing is left to be explained."""
    return evidence.speaks_for and evidence.off_m <= _EXACT_M


def _corrected(
    records: Sequence[GraspRecord], orders: Sequence[IntArray], gauge: Gauge, count: int
) -> Iterator[Found]:
    """Yield grasps with so many of joint order and mirrored hand corrected, one or both."""
    if count not in (1, 2):
        return
    if count == 1:
        yield from (((_MIRRORED,), each) for each in gauge.mirrored(records))
    for source in orders:
        turned = reordered(records, source)
        if count == 1:
            yield (_ORDER,), gauge.evidence(turned)
        else:
            yield from (((_ORDER, _MIRRORED), each) for each in gauge.mirrored(turned))


def _sampled(records: Sequence[GraspRecord], most: int) -> Sequence[GraspRecord]:
    return records[:: max(1, len(records) // most)][:most]


def _reread(
    path: Path, context: FormatContext, name: str, count: int, most: int
) -> Iterator[tuple[tuple[str, ...], Sequence[GraspRecord]]]:
    """Yield what the file would be if its quaternions or units were others, some of its grasps."""
    for size in range(1, len(READINGS) + 1):
        for kinds in combinations(READINGS, size):
            try:
                reread = FORMATS[name].read(path, replace(context, reading=combined_reading(kinds)))
            except GraspbenchError:
                continue
            found = [record for record in reread if record.grasp is not None]
            if len(found) >= count:
                yield kinds, _sampled(found, most)
