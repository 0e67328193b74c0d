"""Can this hand hold its fingertips at these contacts? The constraint of every grasp planner."""

from itertools import permutations

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.errors import HandError
from graspbench.hand.model import HandModel
from graspbench.hand.parameters import Margins
from graspbench.hand.placement import Task, make_work
from graspbench.hand.posture import HandPosture
from graspbench.hand.search import attempt, search

COLD_STARTS = 12
WRIST_WORKSPACE_SAMPLES = 9


class GraspChecker:
    """Decides whether a hand with a floating wrist reaches given contacts, and how.

    The ground and the object's surface are obstacles. The checker holds no other state: the same
    question has the same answer, whatever was asked before.

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
        self._starts = starts
        self._obstacle = np.zeros((0, 3))
        self._assignments: dict[int, IntArray] = {}
        m = self.margins
        self._margins = np.array([m.ground_m, m.hand_m, m.object_m, m.joint, m.singular_value_m])
        self._rest = hand.by_finger(hand.rest)

    def set_object(self, points: FloatArray | None) -> None:
        """Set the points of the object's surface that palm and links must keep clear of, shape (m, 3)."""
        self._obstacle = (
            np.zeros((0, 3)) if points is None else np.ascontiguousarray(points, dtype=float).reshape(-1, 3)
        )

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
            posture = self._warm(task, start)
            if posture is not None:
                return posture
        bits, posture = self._cold(task)
        return posture if bits == 0 else None

    def reason(self, points: FloatArray, normals: FloatArray) -> str:
        """Say in one clause why ``place`` returns None for these contacts; empty if it does not."""
        task = self._task(points, normals)
        gaps = np.linalg.norm(task.points[:, None] - task.points[None, :], axis=2)
        if not np.all(self.vertex_mask(task.points, task.normals)):
            return "a fingertip would hit the ground"
        if gaps.max() > self.pair_limit_m:
            return (
                f"the contacts are {gaps.max() * 1e3:.0f} mm apart, too wide for the hand "
                f"(at most {self.pair_limit_m * 1e3:.0f} mm)"
            )
        bits, posture = self._cold(task)
        if bits == 0:
            return ""
        if bits & 1:
            return f"no wrist pose brings all fingers to the contacts ({posture.tip_error_m * 1e3:.1f} mm are left)"
        clauses = {
            2: "a joint would be at its limit",
            4: "a finger would be near a singularity",
            8: "the hand would hit the ground",
            16: "the fingers would hit each other or the palm",
            32: "the palm or a finger's link would hit the object",
        }
        return next(clause for bit, clause in clauses.items() if bits & bit)

    def vertex_mask(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        """Tell which contacts a fingertip can touch without hitting the ground (necessary), shape (n,)."""
        points, normals = np.asarray(points, dtype=float), np.asarray(normals, dtype=float)
        if self.ground_height_m is None:
            return np.ones(len(points), dtype=np.bool_)
        lowest = points[:, 2] + self.hand.tip_radius_m * (normals[:, 2] - 1.0)
        return np.asarray(lowest >= self.ground_height_m + self.margins.ground_m)

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
        height = -np.inf if self.ground_height_m is None else float(self.ground_height_m)
        radius = self.hand.tip_radius_m
        return Task(points + radius * normals, points, normals, height, self._obstacle, 2 * radius, self._margins)

    def _choices(self, m: int) -> IntArray:
        """Return the fingers each contact may be given, one row a choice."""
        if m not in self._assignments:
            rows = list(permutations(range(self.hand.n_fingers), m))
            if self.hand.symmetric:
                # Turning the wrist turns any choice into one that gives finger 0 to contact 0.
                rows = [row for row in rows if row[0] == 0]
            self._assignments[m] = np.array(rows, dtype=np.int64)
        return self._assignments[m]

    def _cold(self, task: Task) -> tuple[int, HandPosture]:
        chains = self.hand.chains
        rotation, translation, joints = np.eye(3), np.zeros(3), np.array(self._rest)
        contact_of, measured = np.zeros(self.hand.n_fingers, dtype=np.int64), np.zeros(6)
        bits = search(
            chains, self.hand.shapes, task, self._choices(len(task.points)), self._rest, self._starts,
            rotation, translation, joints, contact_of, measured,
        )  # fmt: skip
        return bits, self._posture(rotation, translation, joints, contact_of, measured)

    def _warm(self, task: Task, start: HandPosture) -> HandPosture | None:
        if len(start.fingers) != len(task.points):
            return None
        rotation = np.ascontiguousarray(start.transform_palm_to_world[:3, :3])
        translation = np.ascontiguousarray(start.transform_palm_to_world[:3, 3])
        joints = self.hand.by_finger(start.joints)
        contact_of = np.full(self.hand.n_fingers, -1, dtype=np.int64)
        contact_of[list(start.fingers)] = np.arange(len(start.fingers))
        chains, shapes, measured = self.hand.chains, self.hand.shapes, np.zeros(6)
        work = make_work(chains, shapes, len(task.obstacle))
        bits = attempt(
            chains, shapes, task, contact_of, rotation, translation, joints, work, True, measured
        )
        return None if bits else self._posture(rotation, translation, joints, contact_of, measured)

    def _posture(
        self, rotation: FloatArray, translation: FloatArray, joints: FloatArray, contact_of: IntArray,
        measured: FloatArray,
    ) -> HandPosture:
        transform = np.eye(4)
        transform[:3, :3], transform[:3, 3] = rotation, translation
        fingers = np.argsort(np.where(contact_of < 0, len(contact_of), contact_of), kind="stable")
        return HandPosture(
            transform_palm_to_world=transform,
            joints=self.hand.joint_vector(joints),
            fingers=tuple(int(f) for f in fingers[: int(np.sum(contact_of >= 0))]),
            tip_error_m=float(measured[0]),
            joint_margin=float(measured[1]),
            smallest_singular_value=float(measured[2]),
            clearance_m=float(min(measured[3], measured[4])),
        )


def pair_limit(hand: HandModel) -> float:
    """Return a bound of the distance between two contacts that two fingertips can touch at a time, m.

    The tips' workspaces are sampled; what the samples may miss is bounded by the joints' half steps times
    the reach behind them, so the bound holds for every posture.
    """
    chains, n = hand.chains, hand.n_fingers
    clouds, slack = [], []
    for f in range(n):
        k = int(chains.counts[f])
        count = WRIST_WORKSPACE_SAMPLES if k <= 4 else 5
        grids = [np.linspace(chains.lower[f, j], chains.upper[f, j], count) for j in range(k)]
        joints = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, k)
        clouds.append(_sampled_tips(hand, f, joints))
        reach = np.array([_reach(hand, f, j) for j in range(k)])
        half_steps = (chains.upper[f, :k] - chains.lower[f, :k]) / (2 * (count - 1))
        slack.append(float(reach @ half_steps))
    limit = 0.0
    directions = _sphere_directions(400)
    # Farthest pair through support values; the directions' spacing is covered by 1 / cos of half of it.
    for f in range(n):
        for g in range(f):
            spans = (clouds[f] @ directions.T).max(axis=0) + (-clouds[g] @ directions.T).max(axis=0)
            limit = max(limit, float(spans.max()) / np.cos(0.15) + slack[f] + slack[g])
    return limit + 2 * hand.tip_radius_m


def _sampled_tips(hand: HandModel, f: int, joints: FloatArray) -> FloatArray:
    chains = hand.chains
    tips = np.zeros((len(joints), 3))
    tips += chains.tips[f]
    for j in range(int(chains.counts[f]) - 1, -1, -1):
        c, s = np.cos(joints[:, j]), np.sin(joints[:, j])
        x, y = c * tips[:, 0] - s * tips[:, 1], s * tips[:, 0] + c * tips[:, 1]
        turned = np.column_stack([x, y, tips[:, 2]])
        tips = turned @ chains.rotations[f, j].T + chains.offsets[f, j]
    return tips


def _reach(hand: HandModel, f: int, joint: int) -> float:
    chains = hand.chains
    lengths = np.linalg.norm(chains.offsets[f, joint + 1 : int(chains.counts[f])], axis=1)
    return float(lengths.sum() + np.linalg.norm(chains.tips[f]))


def _sphere_directions(count: int) -> FloatArray:
    i = np.arange(count)
    z = 1 - 2 * (i + 0.5) / count
    angle = i * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
