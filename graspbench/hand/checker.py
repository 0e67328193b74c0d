"""Can this hand hold its fingertips at these contacts? The constraint of every grasp planner."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.errors import HandError
from graspbench.hand.model import HandModel
from graspbench.hand.parameters import Margins
from graspbench.hand.penetration import DEPTH_M, balls_sink
from graspbench.hand.posture import HandPosture
from graspbench.hand.posture_search import (
    COLD_STARTS,
    TIP_TOLERANCE_M,
    Attempt,
    PostureSearch,
)
from graspbench.hand.reach import pair_limit, tip_gap
from graspbench.hand.surroundings import surroundings_of
from graspbench.hand.task import Task
from graspbench.hand.tip_support import FINAL_SHARPNESS_M
from graspbench.hand.verification import verify_posture

if TYPE_CHECKING:
    import trimesh


_MAX_FAILURES = 10_000
"""So many are remembered; each takes a kilobyte."""


class HeldContacts(NamedTuple):
    """Contacts that a hand holds.

    Attributes:
        points: Shape (m, 3), m.
        normals: Outward unit normals, shape (m, 3).
        posture: The hand.
    """

    points: FloatArray
    normals: FloatArray
    posture: HandPosture


class GraspChecker:
    """Decides whether a hand with a floating wrist reaches given contacts, and how.

    The ground and the object's surface are obstacles. The same question has the same answer, whatever was
    asked before; failures are remembered, since a search in vain takes the longest.

    Args:
        hand: The hand.
        ground_height_m: Height of the ground plane in the world; None for no ground.
        margins: What a posture has to keep; the hand's own by default.
        starts: How many starts a cold search tries at most.
    """

    def __init__(
        self,
        hand: HandModel,
        ground_height_m: float | None = 0.0,
        margins: Margins | None = None,
        *,
        starts: int = COLD_STARTS,
    ) -> None:
        self.hand = hand
        self.ground_height_m = ground_height_m
        self.margins = hand.margins if margins is None else margins
        self.pair_limit_m = pair_limit(hand)
        self._search = PostureSearch(hand, ground_height_m is not None, self.margins, starts)
        self.set_object(None)
        m = self.margins
        height = -np.inf if ground_height_m is None else float(ground_height_m)
        self._limits = np.array(
            [height, m.ground_m, m.hand_m, m.object_m, 2 * hand.pad_radius_m, FINAL_SHARPNESS_M]
        )

    def set_object(self, points: FloatArray | None, faces: IntArray | None = None) -> None:
        """Set the object's surface that palm and links must keep clear of.

        Args:
            points: Shape (m, 3); None for no object.
            faces: Its triangles, shape (t, 3); without, only the points are obstacles.
        """
        self._surroundings = surroundings_of(points, faces)
        self._failures: dict[bytes, Attempt] = {}

    def place(
        self, points: FloatArray, normals: FloatArray, *, start: HandPosture | None = None
    ) -> HandPosture | None:
        """Find a posture whose fingertips touch the contacts, or None.

        Args:
            points: Contact points in the world, shape (m, 3), m at most the number of fingers.
            normals: Outward unit normals, shape (m, 3).
            start: A posture for similar contacts in the same order; tried first, much faster.

        Returns:
            A feasible posture: tips within 0.1 mm of their targets (a tip's radius outside the contacts),
            margins kept. From ``start`` the one near it; else the most comfortable one found.
        """
        task = self._task(points, normals)
        if not np.all(self.vertex_mask(task.points, task.normals)):
            return None
        if start is not None:
            near = self._search.near(task, self._surroundings, start)
            if near is not None:
                return near.posture
        attempt = self._anywhere(task)
        return attempt.posture if attempt.failed == 0 else None

    def place_near(
        self, points: FloatArray, normals: FloatArray, near: Sequence[HeldContacts]
    ) -> HandPosture | None:
        """Move postures that hold similar contacts onto these; None when none of them gets there.

        Args:
            points: Contact points in the world, shape (m, 3).
            normals: Outward unit normals, shape (m, 3).
            near: What is held nearby, contacts in the same order.
        """
        task = self._task(points, normals)
        if not np.all(self.vertex_mask(task.points, task.normals)):
            return None
        for held in near:
            found = self._search.near(task, self._surroundings, held.posture)
            if found is not None:
                return found.posture
        return None

    def place_patiently(
        self, points: FloatArray, normals: FloatArray, near: Sequence[HeldContacts]
    ) -> HandPosture | None:
        """Look longer than ``place`` for a posture whose fingertips touch the contacts, or None.

        Postures that hold similar contacts are moved over, at once and then step by step; then come many
        more starts. That none is found still proves nothing; see ``excludes``.

        Args:
            points: Contact points in the world, shape (m, 3).
            normals: Outward unit normals, shape (m, 3).
            near: What is held nearby, contacts in the same order.
        """
        posture = self.place_near(points, normals, near)
        if posture is not None:
            return posture
        task = self._task(points, normals)
        if not np.all(self.vertex_mask(task.points, task.normals)):
            return None
        for held in near:
            found = self._search.follow(task, self._surroundings, held.posture, (held.points, held.normals))
            if found is not None:
                return found.posture
        attempt = self._search.anywhere(task, self._surroundings, patient=True)
        return attempt.posture if attempt.failed == 0 else None

    def excludes(self, points: FloatArray, normals: FloatArray) -> bool:
        """Tell whether it is proved that no posture holds the contacts; True is certain, False says nothing.

        The conditions are necessary ones: each contact by itself (see ``vertex_mask``), each pair of contacts
        neither too far apart for any two fingers nor so near that two fingertips would overlap.
        """
        task = self._task(points, normals)
        if not np.all(self.vertex_mask(task.points, task.normals)):
            return True
        gaps = np.linalg.norm(task.points[:, None] - task.points[None, :], axis=2)
        if gaps.max() > self.pair_limit_m:
            return True
        apart = np.linalg.norm(task.targets[:, None] - task.targets[None, :], axis=2)
        apart[np.diag_indices(len(apart))] = np.inf
        gap = tip_gap(self.hand)
        return gap > 0.0 and bool(apart.min() < gap + self.margins.hand_m - 2.0 * TIP_TOLERANCE_M)

    def verify(
        self,
        posture: HandPosture,
        points: FloatArray,
        normals: FloatArray,
        object_mesh: trimesh.Trimesh | None = None,
    ) -> tuple[str, ...]:
        """Check a posture with full collision shapes, independently of the search; see ``verify_posture``."""
        return verify_posture(
            self.hand,
            posture,
            np.asarray(points),
            np.asarray(normals),
            ground_height_m=self.ground_height_m,
            object_mesh=object_mesh,
            margins=self.margins,
        )

    def reason(self, points: FloatArray, normals: FloatArray) -> str:
        """Say in one clause why ``place`` returns None for these contacts; empty if it does not."""
        task = self._task(points, normals)
        gaps = np.linalg.norm(task.points[:, None] - task.points[None, :], axis=2)
        if not np.all(self._above_ground(task.points, task.normals)):
            return "a fingertip would hit the ground"
        if not np.all(self.vertex_mask(task.points, task.normals)):
            return "a fingertip would sink into the object beside its contact"
        if gaps.max() > self.pair_limit_m:
            return (
                f"the contacts are {gaps.max() * 1e3:.0f} mm apart, too wide for the hand "
                f"(at most {self.pair_limit_m * 1e3:.0f} mm)"
            )
        return self._anywhere(task).reason

    def vertex_mask(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        """Tell which contacts a fingertip can touch at all (necessary), shape (n,).

        It must not hit the ground, nor sink into the object beside the contact, as it would in a crease. Of
        tips that are links the latter is seen only when a posture is tried.
        """
        points, normals = np.asarray(points, dtype=float), np.asarray(normals, dtype=float)
        free = self._above_ground(points, normals)
        if len(self._surroundings.triangles.balls) and not self.hand.tips_are_links:
            free[free] = self._outside_object(points[free], normals[free])
        return free

    def _above_ground(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        if self.ground_height_m is None:
            return np.ones(len(points), dtype=np.bool_)
        lowest = points[:, 2] + self.hand.tip_radius_m * (normals[:, 2] - 1.0)
        return np.asarray(lowest >= self.ground_height_m + self.margins.ground_m)

    def _outside_object(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        radius, sink = self.hand.tip_radius_m, np.zeros(len(points), dtype=np.bool_)
        balls_sink(self._surroundings.triangles, points + radius * normals, radius - DEPTH_M, sink)
        return ~sink

    def _task(self, points: FloatArray, normals: FloatArray) -> Task:
        points = np.ascontiguousarray(points, dtype=float)
        normals = np.ascontiguousarray(normals, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or points.shape != normals.shape or len(points) < 2:
            raise HandError(
                f"contacts of shape {points.shape} with normals of shape {normals.shape}",
                remedy="give two or more points and as many normals",
            )
        if len(points) > self.hand.n_fingers:
            raise HandError(
                f"{len(points)} contacts for the {self.hand.n_fingers} fingers of hand '{self.hand.name}'",
                remedy="use more fingers (hand.fingers) or fewer contacts",
            )
        targets = points + self.hand.tip_radius_m * normals
        return Task(targets, points, normals, self._surroundings.points, self._limits)

    def _anywhere(self, task: Task) -> Attempt:
        """Search from many starts, unless that was in vain before: planners come to the same nodes again."""
        asked = task.points.tobytes() + task.normals.tobytes()
        known = self._failures.get(asked)
        if known is not None:
            return known
        attempt = self._search.anywhere(task, self._surroundings)
        if attempt.failed and len(self._failures) < _MAX_FAILURES:
            self._failures[asked] = attempt
        return attempt
