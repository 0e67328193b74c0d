"""What an arm may hit of itself and of the hand that it carries: convex hulls of its links and of fingers."""

from __future__ import annotations

from collections.abc import Sequence

import coal
import numpy as np
import pinocchio

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.coal_shapes import hull_of_points
from graspbench.hand.hulls import extreme_points
from graspbench.hand.importing.surfaces import surface_points
from graspbench.hand.model import HandModel
from graspbench.simulation.mounts.arm_file import ArmFile, kinematic_model

APART_M = 0.002
"""What has to stay between two bodies."""

_DRAWN, _EDGE, _ALWAYS = 60, 0.05, 0.95
_BASE, _NEAR = -1, 2
_FLAT_M, _DIRECTIONS = 1e-5, 500


class ArmBodies:
    """Tells whether an arm hits itself or the hand, at joint positions.

    Each link counts as its convex hull; of the hand, the palm, and each finger with all that it passes
    between open and closed. Left out are pairs of a link and the next one, pairs with one link in between
    that touch where all joints are at 0 (or the limit nearest to it), and pairs that nearly always touch:
    their hulls overlap by how they are drawn.

    Args:
        arm: The arm.
        hand: The hand.
        transform_palm_to_tip: The palm in the link that carries the hand, shape (4, 4).

    Attributes:
        names: What each body is called in messages.
        pairs: Bodies that must not meet, shape (p, 2).
    """

    def __init__(self, arm: ArmFile, hand: HandModel, transform_palm_to_tip: FloatArray) -> None:
        self._model = kinematic_model(arm.urdf)
        self._data = self._model.createData()
        bodies = [(name, joint, hull) for name, joint, points in arm.bodies if (hull := _hull(points))]
        last = self._model.njoints - 2
        tip = self._model.frames[self._model.getFrameId(arm.tip)].placement.homogeneous
        to_joint = tip @ transform_palm_to_tip
        for name, points in _hand_bodies(hand):
            if hull := _hull(points @ to_joint[:3, :3].T + to_joint[:3, 3]):
                bodies.append((name, last + 1, hull))
        self.names = [name for name, _, _ in bodies]
        self._hulls = [hull for _, _, hull in bodies]
        self._stages = np.array([stage for _, stage, _ in bodies])
        # What the hand's stage stands on is the last joint.
        self._joints = np.minimum(self._stages, last)
        spheres = [_sphere(hull) for hull in self._hulls]
        self._centres = np.array([centre for centre, _ in spheres])
        self._radii = np.array([radius for _, radius in spheres])
        self.pairs = self._checked()

    def first_hit(self, path: FloatArray) -> tuple[str, str] | None:
        """Return the bodies that meet first along joint positions, shape (t, n); None where none do."""
        for joints in path:
            met = self._meeting(joints, self.pairs)
            if met.any():
                a, b = self.pairs[int(np.flatnonzero(met)[0])]
                return self.names[a], self.names[b]
        return None

    def _checked(self) -> IntArray:
        count = len(self._hulls)
        pairs = np.array(
            [
                (a, b)
                for a in range(count)
                for b in range(a + 1, count)
                if abs(int(self._stages[a]) - int(self._stages[b])) > 1
            ],
            dtype=np.int64,
        ).reshape(-1, 2)
        lower, upper = self._model.lowerPositionLimit, self._model.upperPositionLimit
        near = np.abs(self._stages[pairs[:, 0]] - self._stages[pairs[:, 1]]) == _NEAR
        kept = ~(near & self._meeting(np.clip(0.0, lower, upper), pairs))
        shares = np.random.default_rng(0).uniform(_EDGE, 1.0 - _EDGE, (_DRAWN, self._model.nq))
        often = np.mean([self._meeting(lower + share * (upper - lower), pairs) for share in shares], axis=0)
        found: IntArray = pairs[kept & (often < _ALWAYS)]
        return found

    def _meeting(self, joints: FloatArray, pairs: IntArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Tell which pairs of bodies are nearer to each other than they may be, shape (p,)."""
        met = np.zeros(len(pairs), dtype=np.bool_)
        if not len(pairs):
            return met
        pinocchio.forwardKinematics(self._model, self._data, np.asarray(joints, dtype=float))
        poses = [self._data.oMi[int(joint) + 1] for joint in range(_BASE, self._model.njoints - 1)]
        at = [poses[joint + 1] for joint in self._joints]
        centres = np.array([pose.act(centre) for pose, centre in zip(at, self._centres, strict=True)])
        a, b = pairs.T
        apart = np.linalg.norm(centres[a] - centres[b], axis=1)
        placed: dict[int, coal.Transform3s] = {}
        for k in np.flatnonzero(apart < self._radii[a] + self._radii[b] + APART_M):
            one, two = (int(body) for body in pairs[k])
            for body in (one, two):
                if body not in placed:
                    placed[body] = coal.Transform3s(at[body].rotation, at[body].translation)
            met[k] = _meet(self._hulls[one], placed[one], self._hulls[two], placed[two])
        return met


def _meet(one: coal.Convex, at: coal.Transform3s, two: coal.Convex, there: coal.Transform3s) -> bool:
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    request.security_margin = APART_M
    return bool(coal.collide(one, at, two, there, request, result) > 0)


def _hull(points: FloatArray) -> coal.Convex | None:
    """Return the convex hull of points; None for less than a solid."""
    if len(points) < 4 or np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[2] < _FLAT_M:
        return None
    return hull_of_points(extreme_points(points, _DIRECTIONS))


def _sphere(hull: coal.Convex) -> tuple[FloatArray, float]:
    points = np.asarray(hull.points(), dtype=float).reshape(-1, 3)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def _hand_bodies(hand: HandModel) -> Sequence[tuple[str, FloatArray]]:
    """Return name and points in the palm's frame of the palm and of each finger, open and closed."""
    model, data = hand.model, hand.model.createData()
    to_palm = np.linalg.inv(hand.transform_palm_to_root)
    found: dict[int, list[FloatArray]] = {}
    for joints in (hand.rest, hand.preferred):
        pinocchio.forwardKinematics(model, data, joints)
        for item in hand.geometry.geometryObjects:
            support = model.supports[item.parentJoint]
            first = int(support[1]) if len(support) > 1 else 0
            pose = to_palm @ (data.oMi[item.parentJoint] * item.placement).homogeneous
            found.setdefault(first, []).append(surface_points(item.geometry) @ pose[:3, :3].T + pose[:3, 3])
    name = f"hand '{hand.name}'"
    palm, finger = f"the palm of {name}", "the finger of joint '{}' of " + name
    return [
        (finger.format(model.names[first]) if first else palm, np.vstack(each))
        for first, each in found.items()
    ]
