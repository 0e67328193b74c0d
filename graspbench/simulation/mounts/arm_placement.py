"""Where the arm's base stands: beside the object, so that the whole task is within reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import SimulationError
from graspbench.simulation.mounts.arm_chain import comfort_of_path
from graspbench.simulation.mounts.arm_model import FIRST_LOW_JOINT, ArmModel
from graspbench.simulation.mounts.mount import PalmTask

_DISTANCES = (0.58, 0.48, 0.68, 0.38, 0.78)
_HEIGHTS = (0.0, 0.3)
"""Shares of what the arm reaches: from the object, and of a pedestal that the arm stands on."""

_AZIMUTHS = 12
_SEEDS, _STARTS = 6, 2

_REACHED_M = 1e-4
_MIN_MARGIN = 0.02
_MIN_DEXTERITY = 0.02
_GOOD_DEXTERITY = 0.15
_ENOUGH = 0.2
_SPEED_SHARE = 0.9
"""Of the joints' greatest speeds, between poses: they may be exceeded in between."""

_CLEARANCE_M = 0.005


@dataclass(frozen=True)
class Placement:
    """A place of the arm's base, and how the task is done from there.

    Attributes:
        arm: The arm with the bracket that the hand is bolted on with.
        transform_base_to_world: Shape (4, 4).
        joints: Joint positions at the first pose of the palm, shape (n,), rad or m.
        tilt_direction: Which way the wrist tilts after the lift, 1 or -1.
        score: Least share, over the task, of a comfortable distance from joint limits and singularities.
    """

    arm: ArmModel
    transform_base_to_world: FloatArray
    joints: FloatArray
    tilt_direction: float
    score: float


def place_arm(arms: Sequence[ArmModel], task: PalmTask) -> Placement:
    """Return the place around the object from which the arm does its task best.

    Twelve directions, five distances and two heights (a pedestal) are tried in a fixed order, until one
    will do well. Where the first joint turns the whole arm, the base is turned so that this joint is in the
    middle of its range during the task.

    Args:
        arms: The arm with different brackets.
        task: What the palm has to do.

    Raises:
        SimulationError: From none of the places the task can be done.
    """
    best: Placement | None = None
    for height, distance in product(_HEIGHTS, _DISTANCES):
        for k, arm in product(range(_AZIMUTHS), arms):
            away, up = distance * arm.reach_m, height * arm.reach_m
            base = _base_pose(task.object_position, away, up, 2.0 * np.pi * k / _AZIMUTHS)
            best = _better(best, arm, base, task)
        if best is not None and best.score > _ENOUGH:
            break
    if best is None:
        raise SimulationError(
            "the arm can follow the hand's motion from no place beside the object",
            remedy="choose arm=floating or another arm, or less lift, rotation or shaking, or more time",
        )
    return best


def _better(best: Placement | None, arm: ArmModel, base: FloatArray, task: PalmTask) -> Placement | None:
    """Return the best way to do the task from a place, if it is better than the best so far; else that."""
    to_base = np.linalg.inv(base)
    if any(_is_too_far(arm, to_base @ palms) for palms, _ in task.poses.values()):
        return best
    height = float(base[2, 3])
    for joints, (direction, (palms, times_s)) in product(
        _first_joints(arm, to_base @ task.start, height), task.poses.items()
    ):
        least = 0.0 if best is None else best.score
        score, turn = _score(arm, joints, to_base @ palms, times_s, height, least, arm.turns_upright)
        if score <= least:
            continue
        turned, first, inside = base, joints, to_base @ palms
        if arm.turns_upright:
            turned, first = _turned(base, turn), joints - turn * np.eye(arm.n)[0]
            inside = np.linalg.inv(turned) @ palms
            score, _ = _score(arm, first, inside, times_s, height, least, False)
        if score > least and arm.bodies.first_hit(arm.path(first, inside, times_s)) is None:
            best = Placement(arm, turned, first, direction, score)
    return best


def _base_pose(object_position: FloatArray, distance_m: float, height_m: float, azimuth: float) -> FloatArray:
    """Return the pose of a base that faces the object with its x axis, shape (4, 4)."""
    direction = np.array([np.cos(azimuth), np.sin(azimuth)])
    base = np.eye(4)
    base[:2, 0], base[:2, 1] = -direction, [direction[1], -direction[0]]
    base[:2, 3] = object_position[:2] + distance_m * direction
    base[2, 3] = height_m
    return base


def _turned(base: FloatArray, angle: float) -> FloatArray:
    """Return a base turned about its own z axis, shape (4, 4)."""
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turned: FloatArray = base @ turn
    return turned


def _is_too_far(arm: ArmModel, palms: FloatArray) -> bool:
    """Whether a pose in the base frame is beyond the stretched arm."""
    return bool(np.linalg.norm(palms[:, :3, 3] - arm.pivot, axis=1).max() > arm.reach_m)


def _first_joints(arm: ArmModel, first: FloatArray, height_m: float) -> list[FloatArray]:
    """Return the different ways in which the arm reaches the first pose, the most comfortable ones."""
    found: list[tuple[float, FloatArray]] = []
    for seed in arm.seeds(first, _SEEDS):
        joints = arm.reach(seed, first)
        state = arm.assess(joints, first)
        comfort = _comfort(_least_margin(state.margins, arm.turns_upright), state.dexterity)
        fits = comfort > 0.0 and state.error_m < _REACHED_M and state.lowest_m + height_m > _CLEARANCE_M
        if not fits or any(np.abs(other - joints).max() < 0.1 for _, other in found):
            continue
        if arm.bodies.first_hit(joints[None]) is None:
            found.append((comfort, joints))
    return [joints for _, joints in sorted(found, key=lambda item: -item[0])[:_STARTS]]


def _score(
    arm: ArmModel,
    joints: FloatArray,
    palms: FloatArray,
    times_s: FloatArray,
    height_m: float,
    least: float,
    base_turns: bool,
) -> tuple[float, float]:
    """Return the comfort of the task's least comfortable pose; 0 when it cannot be done, or not so fast.

    Where the base may still be turned, the first joint's range does not count, and the turn is returned too
    that brings this joint to the middle of its range, rad.
    """
    rules = (arm.centring_rate, _REACHED_M, _CLEARANCE_M - height_m, _MIN_MARGIN, _MIN_DEXTERITY)
    comfort, low, high = comfort_of_path(
        arm.chain,
        joints,
        np.ascontiguousarray(palms),
        np.diff(times_s, prepend=times_s[0]),
        _SPEED_SHARE * arm.speed_limits,
        FIRST_LOW_JOINT,
        np.array([*rules, _GOOD_DEXTERITY, least]),
        not base_turns,
    )
    return comfort, 0.5 * (low + high) - 0.5 * float(arm.lower[0] + arm.upper[0])


def _least_margin(margins: FloatArray, base_turns: bool) -> float:
    return float((margins[1:] if base_turns else margins).min())


def _comfort(margin: float, dexterity: float) -> float:
    if margin < _MIN_MARGIN or dexterity < _MIN_DEXTERITY:
        return 0.0
    return min(margin, dexterity / _GOOD_DEXTERITY)
