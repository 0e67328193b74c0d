"""Touches before the grasp: single fingers feel where the object is, each where that is worth most."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.configuration import Grasp
from graspbench.reconstruction.felt_surface import (
    PoseBelief,
    corrected_surface,
    planar_transform,
    updated_belief,
)
from graspbench.reconstruction.surface import Surface
from graspbench.simulation.phases import smooth
from graspbench.simulation.stage import Stage
from graspbench.simulation.touch import Touch
from graspbench.simulation.touch_parameters import TouchParameters

_TURNS_DEG = (0.0, 20.0, -20.0, 40.0, -40.0)
_LIFTS_M = (0.0, 0.008)
_MOVE_S = 0.4
_CLEARANCE_M = 0.006
_ALREADY_M = 0.006
"""A place of the surface nearer than this to one that was tried tells nothing new."""


@dataclass(frozen=True)
class FeltParts:
    """What exploring touches need besides the plan.

    Attributes:
        surface: The surface as vision saw it.
        closing: First sample of the path's last approach; there the open hand floats over the surface.
    """

    surface: Surface
    closing: int


@dataclass(frozen=True)
class Exploration:
    """What exploring touches found.

    Attributes:
        belief: Where the surface is.
        felt: Felt points in the world, shape (n, 3).
        surface: As vision saw it, corrected near the felt points.
        grasp: The planned grasp on the corrected surface, not moved.
        tried: Touches that were tried; the others met nothing.
        time_s: Simulated time that they took.
        expected_before_m: Root of the contacts' mean expected squared error before the touches.
        expected_after_m: The same after them.
        pose_before: Where the object truly was when the touches began, shape (4, 4): for the verdict only.
        pose_after: And when they ended.
    """

    belief: PoseBelief
    felt: FloatArray
    surface: Surface
    grasp: Grasp
    tried: int
    time_s: float
    expected_before_m: float
    expected_after_m: float
    pose_before: FloatArray
    pose_after: FloatArray


@dataclass(frozen=True)
class _Candidate:
    finger: int
    turn: FloatArray  # of the palm, shape (4, 4)
    place: FloatArray
    normal: FloatArray


class Explorer:
    """A hand that stands open around an object and feels it with one finger after the other.

    Args:
        stage: Hand and object; the hand floats at the end of its approach.
        grasp: The planned grasp.
        fingers: The fingers that it uses.
        surface: The surface as vision saw it.
        joints: The fingers' joints there, shape (n_q,).
        palm: The palm there, transform_palm_to_world, shape (4, 4).
        parameters: How many touches, and what is believed.
    """

    def __init__(
        self,
        stage: Stage,
        grasp: Grasp,
        fingers: Sequence[int],
        surface: Surface,
        joints: FloatArray,
        palm: FloatArray,
        parameters: TouchParameters,
    ) -> None:
        self._stage, self._model = stage, stage.model
        self._grasp, self._fingers, self._surface = grasp, tuple(fingers), surface
        self._joints, self._floating, self._p = joints, palm, parameters
        self._turn = np.eye(4)
        self._tips = self._model.tip_positions(joints)

    def explore(self) -> Exploration:
        """Touch until enough is known, the number of touches is used up, or nothing is worth a touch."""
        p, start_s, before = self._p, self._stage.time_s, self._stage.object_pose()
        prior = PoseBelief.prior(
            self._grasp.centroid, p.position_std_mm * 1e-3, float(np.radians(p.yaw_std_deg))
        )
        noise_m, belief, felt, tried = 1e-3 * p.noise_mm, prior, np.empty((0, 3)), 0
        places: list[FloatArray] = []
        while tried < p.max_touches and self._error_m(belief) > 1e-3 * p.enough_mm:
            chosen = self._choose(belief, places)
            if chosen is None:
                break
            tried += 1
            self._move(chosen.turn)
            touch = self._feel(chosen)
            places.append(_back(belief.transform, chosen.place))
            if touch is None:
                continue
            felt = np.vstack((felt, self._tip_contact(touch)))
            belief = updated_belief(prior, self._surface, felt, noise_m)
        self._move(np.eye(4), belief.transform)
        surface = corrected_surface(
            self._surface,
            belief,
            felt,
            noise_m=noise_m,
            shape_std_m=1e-3 * p.shape_std_mm,
            length_m=1e-3 * p.shape_length_mm,
        )
        vertices = self._grasp.vertices
        grasp = replace(self._grasp, points=surface.points[vertices], normals=surface.normals[vertices])
        return Exploration(
            belief,
            felt,
            surface,
            grasp,
            tried,
            self._stage.time_s - start_s,
            self._error_m(prior),
            self._error_m(belief),
            before,
            self._stage.object_pose(),
        )

    def _error_m(self, belief: PoseBelief) -> float:
        """Return the root of the mean expected squared error of a contact's place."""
        points = self._grasp.points
        return float(np.sqrt(belief.expected_square_m2(points) / len(points)))

    def _choose(self, belief: PoseBelief, places: Sequence[FloatArray]) -> _Candidate | None:
        """Return the touch with the largest expected gain, of those that the open hand can do."""
        pose = belief.transform
        points = self._surface.points @ pose[:3, :3].T + pose[:3, 3]
        normals = self._surface.normals @ pose[:3, :3].T
        candidates = []
        for turn_deg in _TURNS_DEG:
            for lift_m in _LIFTS_M:
                turn = pose @ planar_transform(belief.pivot, np.array([0.0, 0.0, np.radians(turn_deg)]))
                turn[2, 3] += lift_m
                candidates += self._candidates(turn, points, normals)
        # The belief is told of the surface as vision saw it.
        left = [(c, _back(pose, c.place)) for c in candidates]
        left = [(c, at) for c, at in left if all(np.linalg.norm(at - p) > _ALREADY_M for p in places)]
        if not left:
            return None
        seen = np.array([at for _, at in left])
        directions = np.array([c.normal for c, _ in left]) @ pose[:3, :3]
        gains = belief.expected_gain_m2(seen, directions, self._grasp.points, 1e-3 * self._p.noise_mm)
        return left[int(np.argmax(gains))][0]

    def _candidates(self, turn: FloatArray, points: FloatArray, normals: FloatArray) -> list[_Candidate]:
        """Return where each finger would meet the surface if the palm were turned so and stood clear."""
        palm = turn @ self._floating
        tips = self._tips @ palm[:3, :3].T + palm[:3, 3]
        radius = self._model.tip_radius_m
        gaps = np.linalg.norm(points[:, None] - tips[None], axis=2).min(axis=0) - radius
        if gaps[list(self._fingers)].min() < _CLEARANCE_M:
            return []
        found = []
        for i, finger in enumerate(self._fingers):
            inward = -(turn[:3, :3] @ self._grasp.normals[i])
            from_tip = points - tips[finger]
            along = from_tip @ inward
            across = np.linalg.norm(from_tip - along[:, None] * inward, axis=1)
            meets = (across < radius) & (along > 0.0)
            if not meets.any():
                continue
            way = along[meets] - np.sqrt(radius**2 - across[meets] ** 2)
            first = np.flatnonzero(meets)[int(np.argmin(way))]
            found.append(_Candidate(i, turn, points[first], normals[first]))
        return found

    def _move(self, turn: FloatArray, correction: FloatArray | None = None) -> None:
        """Turn the open hand about the object, or to where the object was found."""
        goal = turn if correction is None else correction
        before, steps = self._turn, max(1, round(_MOVE_S / self._stage.time_step_s))
        angles = [float(np.arctan2(each[1, 0], each[0, 0])) for each in (before, goal)]
        pivot = self._grasp.centroid
        shifts = [each[:3, :3] @ pivot + each[:3, 3] - pivot for each in (before, goal)]
        for k in range(1, steps + 1):
            share = smooth(k / steps)
            angle = (1.0 - share) * angles[0] + share * angles[1]
            shift = (1.0 - share) * shifts[0] + share * shifts[1]
            pose = planar_transform(pivot, np.array([shift[0], shift[1], angle]))
            pose[2, 3] += shift[2]
            self._drive(pose @ self._floating, self._joints, np.zeros_like(self._joints))
        self._turn = goal

    def _feel(self, chosen: _Candidate) -> Touch | None:
        """Close one finger until it touches, and open it again."""
        stage, p, dt = self._stage, self._p, self._stage.time_step_s
        finger = self._fingers[chosen.finger]
        index = self._model.finger_joints(finger)
        palm = self._turn @ self._floating
        inward = -(self._floating[:3, :3].T @ self._grasp.normals[chosen.finger])
        wanted, touch = self._joints.copy(), None
        path = [wanted.copy()]
        for _ in range(round(1e-3 * p.reach_mm / (p.speed_m_s * dt))):
            jacobian = self._model.tip_jacobians(wanted)[finger][:, index]
            damped = jacobian @ jacobian.T + 1e-6 * np.eye(3)
            step = jacobian.T @ np.linalg.solve(damped, p.speed_m_s * dt * inward)
            following = wanted.copy()
            following[index] += step
            following = np.clip(following, self._model.lower, self._model.upper)
            self._drive(palm, following, (following - wanted) / dt)
            wanted = following
            path.append(wanted.copy())
            touch = stage.hand.touches(stage.parameters.contact_force_n)[finger]
            if touch is not None:
                break
        for joints in path[::-3]:
            self._drive(palm, joints, np.zeros_like(joints))
        return touch if touch is not None and touch.by_tip else None

    def _tip_contact(self, touch: Touch) -> FloatArray:
        there = np.eye(4)
        there[:3, 3] = touch.point
        return self._stage.as_planned(there)[:3, 3]

    def _drive(self, palm: FloatArray, joints: FloatArray, velocities: FloatArray) -> None:
        stage = self._stage
        stage.hand.drive_wrist(stage.carried(palm, stage.time_step_s), stage.time_step_s)
        stage.hand.drive_joints(joints, velocities)
        stage.step()


def _back(transform: FloatArray, point: FloatArray) -> FloatArray:
    """Return the point that a rigid transform, shape (4, 4), brings to a point."""
    back: FloatArray = transform[:3, :3].T @ (point - transform[:3, 3])
    return back
