"""Orders of a hand's joints that a writer of grasps may have had."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from graspbench.arrays import IntArray
from graspbench.evaluation.fault_evidence import hand_of
from graspbench.evaluation.formats.hand_layout import hand_layout
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.hand.model import HandModel

_MAX_BLOCKS = 5


def other_orders(hand: HandModel, name: str) -> Iterator[IntArray]:
    """Yield where each joint's value stands if the writer had the joints in another order, shape (n_q,).

    Args:
        hand: The hand.
        name: The format; its layout states the order that is read.
    """
    stated = [hand.joint_names[i] for i in hand_layout(hand, name).to_hand]
    at = {joint: i for i, joint in enumerate(hand.joint_names)}
    seen = {tuple(stated)}
    for order in _orders(hand, stated):
        if order in seen or set(order) != set(stated):
            continue
        seen.add(order)
        source: IntArray = np.arange(hand.n_joints)
        for joint in stated:
            # What was meant for this joint stands where the writer had it.
            source[at[joint]] = at[stated[order.index(joint)]]
        yield source


def reordered(records: Sequence[GraspRecord], source: IntArray) -> list[GraspRecord]:
    """Return grasps with their joints taken from other places; see `other_orders`."""
    found = []
    for record in records:
        hand = hand_of(record)
        found.append(replace(record, grasp=replace(hand, joints=hand.joints[source])))
    return found


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
