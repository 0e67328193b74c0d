"""The way of a fingertip from one contact to another: off the surface, over it, and onto it again."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from graspbench.arrays import FloatArray
from graspbench.hand import HandModel
from graspbench.hand.penetration import Triangles
from graspbench.hand.swept import collisions
from graspbench.manipulation.gaiting.turning import Turning
from graspbench.manipulation.motion import quintic

_KNOTS = 25
_ARRIVED_M = 1e-8
_ASTRAY_M = 5e-4
_FAR_RAD, _NEAR_RAD = 0.8, 0.3
_LIFTS = (1.0, 1.8, 3.0)
_HAND_MARGIN_M = 5e-4
_STRAIGHT = 0.25
"""Share of the way that goes along the normal only, at either end."""


@dataclass(frozen=True, eq=False)
class FingerStep:
    """A step of one finger, the others and the object at rest.

    Attributes:
        finger: Which finger of the hand.
        shares: Ascending from 0 to 1, shape (n,).
        joints: Of the whole hand, shape (n, n_q), rad.
    """

    finger: int
    shares: FloatArray
    joints: FloatArray

    def path(self) -> PchipInterpolator:
        """Return joints by share; nowhere beyond those of two neighbouring knots, so within limits."""
        return PchipInterpolator(self.shares, self.joints)


class Stepping:
    """Knows what is in the fingers' way, and finds ways for their tips around it.

    Args:
        hand: The hand.
        triangles: The object's surface, object frame.
        turning: How the object turns in the palm.
        lift_m: How far a tip keeps off the surface.
    """

    def __init__(self, hand: HandModel, triangles: Triangles, turning: Turning, lift_m: float) -> None:
        self._hand, self._triangles, self._turning, self._lift_m = hand, triangles, turning, lift_m

    def step(
        self,
        finger: int,
        joints: FloatArray,
        goal: FloatArray,
        normals: tuple[FloatArray, FloatArray],
        turned_deg: float,
        holding: tuple[int, ...],
    ) -> FingerStep | None:
        """Return a clear way of a finger, None if none of a few is.

        Args:
            finger: Which finger.
            joints: Of the whole hand at the start, shape (n_q,).
            goal: Of the finger at the end, shape (k,).
            normals: Outward normals of the contact left and the new one, object frame.
            turned_deg: How far the object has turned.
            holding: The fingers on contacts meanwhile.
        """
        there, pose = joints.copy(), self._turning.pose(turned_deg)
        there[self._hand.finger_joints(finger)] = goal
        if not self.is_clear(there[None], pose, (*holding, finger)):
            return None
        for times in _LIFTS:
            found = self._way(finger, joints, goal, normals, turned_deg, times * self._lift_m)
            # at the very ends the tip touches
            if found is not None and self.is_clear(found.joints[2:-2], pose, holding):
                return found
        return None

    def _way(
        self,
        finger: int,
        joints: FloatArray,
        goal: FloatArray,
        normals: tuple[FloatArray, FloatArray],
        turned_deg: float,
        lift_m: float,
    ) -> FingerStep | None:
        hand, own = self._hand, self._hand.finger_joints(finger)
        shares = 0.5 * (1.0 - np.cos(np.pi * np.arange(_KNOTS) / (_KNOTS - 1)))  # denser at the ends
        ends = np.tile(joints, (2, 1))
        ends[1, own] = goal
        first, last = (hand.tip_positions(q)[finger] for q in ends)
        to_palm = self._turning.at(turned_deg)
        targets = _over(
            self._turning, first, last, (to_palm @ normals[0], to_palm @ normals[1]), lift_m, shares
        )
        way = np.tile(joints, (_KNOTS, 1))
        blend = np.array([quintic(share)[0] for share in shares])
        way[:, own] += blend[:, None] * (goal - joints[own])
        inner = way[1:-1, own]
        # the joints nearest to those in between: a path as smooth as the tip's
        found = hand.finger_ik(finger, targets[1:-1], inner, centring=0.0)
        if found.error_m.max() > _ASTRAY_M or np.abs(found.joints - inner).max() > _FAR_RAD:
            return None
        way[1:-1, own] = found.joints
        if np.abs(np.diff(way[:, own], axis=0)).max() > _FAR_RAD:
            return None
        return FingerStep(finger, shares, way)

    def is_clear(
        self, joints: FloatArray, transform_object_to_palm: FloatArray, holding: tuple[int, ...]
    ) -> bool:
        """Return whether the hand keeps off object and itself, but for the tips of the fingers that hold.

        Args:
            joints: Samples of a motion, shape (n, n_q), rad.
            transform_object_to_palm: The object at rest, shape (4, 4).
            holding: Fingers of the hand.
        """
        palm = np.broadcast_to(np.linalg.inv(transform_object_to_palm), (len(joints), 4, 4))
        return not collisions(
            self._hand, self._triangles, palm, joints, 0, holding, hand_margin_m=_HAND_MARGIN_M
        ).any()


def _over(
    turning: Turning,
    first: FloatArray,
    last: FloatArray,
    normals: tuple[FloatArray, FloatArray],
    lift_m: float,
    shares: FloatArray,
) -> FloatArray:
    """Return tip centres in the palm frame from one place to another around the axis, shape (n, 3)."""
    axis = turning.axis
    arms = [first - turning.position, last - turning.position]
    heights = [float(arm @ axis) for arm in arms]
    flat = [arm - height * axis for arm, height in zip(arms, heights, strict=True)]
    radii = [float(np.linalg.norm(arm)) for arm in flat]
    x = flat[0] / radii[0]
    y = np.cross(axis, x)
    sweep = float(np.arctan2(flat[1] @ y, flat[1] @ x))
    points = np.empty((len(shares), 3))
    for k, share in enumerate(shares):
        u = quintic((share - _STRAIGHT) / (1.0 - 2.0 * _STRAIGHT))[0]
        up = quintic(share / (1.5 * _STRAIGHT))[0] - quintic(1.0 - (1.0 - share) / (1.5 * _STRAIGHT))[0]
        angle, radius = u * sweep, radii[0] + u * (radii[1] - radii[0])
        away = (1.0 - u) * normals[0] + u * normals[1]
        away /= max(float(np.linalg.norm(away)), 1e-9)
        points[k] = turning.position + radius * (np.cos(angle) * x + np.sin(angle) * y)
        points[k] += (heights[0] + u * (heights[1] - heights[0])) * axis + lift_m * up * away
    return points


def touch_down(hand: HandModel, finger: int, joints: FloatArray, target: FloatArray) -> FloatArray | None:
    """Return a finger's joints nearby that bring its tip exactly to a target, shape (k,); None if none do.

    Args:
        hand: The hand.
        finger: Which finger.
        joints: Of the finger, shape (k,).
        target: Tip centre in the palm frame, shape (3,).
    """
    found = hand.finger_ik(finger, target[None], joints, centring=0.0)
    if found.error_m[0] > _ARRIVED_M or np.abs(found.joints[0] - joints).max() > _NEAR_RAD:
        return None
    out: FloatArray = found.joints[0]
    return out
