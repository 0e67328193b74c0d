"""The search for a posture whose fingertips touch given contacts, from one start or from many."""

from itertools import permutations
from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.chains import LOWER, PREFERRED, UPPER, Chains
from graspbench.hand.collision import measure_clearances
from graspbench.hand.gaps import MIN_LEAN
from graspbench.hand.kinematics import finger_ik_batch
from graspbench.hand.model import HandModel
from graspbench.hand.parameters import Margins
from graspbench.hand.penetration import DEPTH_M, links_sink
from graspbench.hand.placement import improve, settle
from graspbench.hand.posture import HandPosture
from graspbench.hand.starts import CHOICES, approach_directions, rank_starts
from graspbench.hand.surroundings import Surroundings
from graspbench.hand.task import HEIGHT, SHARPNESS, Task, make_system
from graspbench.hand.tip_support import FINAL_SHARPNESS_M
from graspbench.hand.touching import touched

COLD_STARTS = 12
REACH_STEPS, COLD_STEPS, WARM_STEPS, SETTLE_STEPS = 10, 18, 10, 12
TIP_TOLERANCE_M = 1e-5
GOOD_ENOUGH, ENOUGH = 0.5, 3  # a comfort, or a number of feasible postures, that ends a search
HOPELESS_COST = 400.0  # tips stay about 2 cm away
JOINT_BUFFER = 1.5  # the optimisation keeps this many times the margin to joint limits
PATIENT_STARTS, PATIENT_CHOICES = 240, 6
"""Starts of a patient search, and choices of fingers that each direction is tried with."""

FOLLOW_STEPS = 6
"""Steps in which a posture is moved from contacts to others when one step fails."""

IN_VAIN, NEAR_COST = 4, 5.0  # starts after which a search ends when none has come as near as that
# What is comfortable: joint margin, singular value, clearances to ground, hand and object.
COMFORT = np.array([0.15, 0.02, 0.006, 0.004, 0.002])
TIPS, JOINTS, SINGULAR, GROUND, HAND, OBJECT, PAD = 1, 2, 4, 8, 16, 32, 64
BITS = np.array([TIPS, JOINTS, SINGULAR, GROUND, HAND, OBJECT])
CLAUSES = {
    JOINTS: "a joint would be at its limit",
    SINGULAR: "a finger would be near a singularity",
    GROUND: "the hand would hit the ground",
    HAND: "the fingers would hit each other or the palm",
    OBJECT: "the palm or a finger's link would hit the object",
    PAD: "a finger would touch beside its pad",
}


SHARPNESSES_M = (3e-4, 6e-5, FINAL_SHARPNESS_M)
"""The soft maxima's tau on the way to a posture, for tips that are links: rounder ones move more smoothly."""


def _blunted(limits: FloatArray, sharpness_m: float) -> FloatArray:
    """Return a task's limits with another soft maximum of the tips' shapes."""
    out = limits.copy()
    out[SHARPNESS] = sharpness_m
    return out


class Attempt(NamedTuple):
    """What came out of one start.

    Attributes:
        failed: Sum of what it fails: TIPS, JOINTS, SINGULAR, GROUND, HAND, OBJECT, PAD; 0 when feasible.
        comfort: The larger, the better; 1 is comfortable.
        cost: Where the optimisation ended.
        posture: The posture, feasible or not.
    """

    failed: int
    comfort: float
    cost: float
    posture: HandPosture

    @property
    def reason(self) -> str:
        """What it fails, in one clause; empty when it is feasible."""
        if self.failed & TIPS:
            left = f"{self.posture.tip_error_m * 1e3:.1f} mm are left"
            return f"no wrist pose brings all fingers to the contacts ({left})"
        return next((clause for bit, clause in CLAUSES.items() if self.failed & bit), "")


class PostureSearch:
    """Searches postures of one hand.

    Args:
        hand: The hand.
        grounded: Whether there is a ground.
        margins: What a posture has to keep.
        starts: How many starts a search from anywhere tries at most.
    """

    def __init__(self, hand: HandModel, grounded: bool, margins: Margins, starts: int) -> None:
        self._hand, self._grounded, self._starts = hand, grounded, starts
        m = margins
        self._margins = np.array([m.joint, m.singular_value_m, m.ground_m, m.hand_m, m.object_m])
        self._assignments: dict[int, IntArray] = {}
        self._by_wrist = hand.places_by_wrist
        self._rest = hand.by_finger(hand.rest)
        self._tips = hand.tip_positions(hand.preferred)
        self._system = make_system(hand.chains, hand.shapes)

    def anywhere(self, task: Task, surroundings: Surroundings, *, patient: bool = False) -> Attempt:
        """Try several starts: the first posture comfortable enough, or the most comfortable of a few.

        Args:
            task: What to reach and what to avoid.
            surroundings: The object.
            patient: Try many more directions and choices of fingers, and do not give up early.
        """
        poses, fingers = rank_starts(
            approach_directions(task.points, task.normals, self._grounded, dense=patient),
            task.targets,
            self._choices(len(task.points)),
            self._tips,
            task.limits[HEIGHT],
            PATIENT_STARTS if patient else self._starts,
            PATIENT_CHOICES if patient else CHOICES,
        )
        preferred = self._hand.chains.limits[:, :, PREFERRED]
        tried: list[Attempt] = []
        for pose, chosen in zip(poses, fingers, strict=True):
            joints = self._rest.copy()
            joints[chosen] = preferred[chosen]
            tried.append(
                self._attempt(task, surroundings, chosen, np.ascontiguousarray(pose), joints, cold=True)
            )
            feasible = [attempt.comfort for attempt in tried if attempt.failed == 0]
            if len(feasible) == ENOUGH or max(feasible, default=0.0) >= GOOD_ENOUGH:
                break
            if not patient and len(tried) == IN_VAIN and min(attempt.cost for attempt in tried) > NEAR_COST:
                break
        return max(tried, key=lambda attempt: (attempt.failed == 0, attempt.comfort))

    def near(self, task: Task, surroundings: Surroundings, start: HandPosture) -> Attempt | None:
        """Move a posture for similar contacts onto these; None when that fails."""
        if len(start.fingers) != len(task.points):
            return None
        pose, fingers = np.array(start.transform_palm_to_world[:3]), np.array(start.fingers)
        joints = self._hand.by_finger(start.joints)
        attempt = self._attempt(task, surroundings, fingers, pose, joints, cold=False)
        return attempt if attempt.failed == 0 else None

    def follow(
        self,
        task: Task,
        surroundings: Surroundings,
        start: HandPosture,
        before: tuple[FloatArray, FloatArray],
    ) -> Attempt | None:
        """Move a posture step by step from its own contacts to these; None when that fails.

        Args:
            task: What to reach and what to avoid.
            surroundings: The object.
            start: A posture.
            before: The contacts and normals that it holds, in the order of the task's, shape (m, 3) each.
        """
        pose, fingers = np.array(start.transform_palm_to_world[:3]), np.array(start.fingers)
        joints = self._hand.by_finger(start.joints)
        attempt: Attempt | None = None
        for share in np.linspace(0.0, 1.0, FOLLOW_STEPS + 1)[1:]:
            points = before[0] + share * (task.points - before[0])
            normals = before[1] + share * (task.normals - before[1])
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
            targets = points + self._hand.tip_radius_m * normals
            between = task if share == 1.0 else task._replace(targets=targets, points=points, normals=normals)
            attempt = self._attempt(between, surroundings, fingers, pose, joints, cold=False)
        return attempt if attempt is not None and attempt.failed == 0 else None

    def _choices(self, m: int) -> IntArray:
        """Return the fingers each contact may be given, one row a choice."""
        if m not in self._assignments:
            rows = list(permutations(range(self._hand.n_fingers), m))
            if self._hand.symmetric:
                # Turning the wrist turns any choice into one that gives finger 0 to contact 0.
                rows = [row for row in rows if row[0] == 0]
            self._assignments[m] = np.array(rows, dtype=np.int64)
        return self._assignments[m]

    def _attempt(
        self,
        task: Task,
        surroundings: Surroundings,
        fingers: IntArray,
        pose: FloatArray,
        joints: FloatArray,
        *,
        cold: bool,
    ) -> Attempt:
        """Improve one start, pose and joints in place, and judge where it ends."""
        hand, system = self._hand, self._system
        guide = task._replace(obstacle=surroundings.guide)
        if hand.tips_are_links:
            guide = guide._replace(limits=_blunted(task.limits, SHARPNESSES_M[0]))
        chains = self._within_margins(fingers)
        contact_of = np.full(hand.n_fingers, -1, dtype=np.int64)
        contact_of[fingers] = np.arange(len(fingers))
        if cold:
            # Reach first: collisions of a posture that is far off say nothing.
            cost = improve(chains, hand.shapes, guide, contact_of, pose, joints, system, False, REACH_STEPS)
            if cost > HOPELESS_COST:
                error = float(np.sqrt(cost)) * 1e-3
                posture = self._posture(pose, joints, fingers, np.array([error, 0.0, 0.0]), np.zeros(3))
                return Attempt(TIPS, -error, cost, posture)
        steps = COLD_STEPS if cold else WARM_STEPS
        cost = improve(chains, hand.shapes, guide, contact_of, pose, joints, system, True, steps)
        quantities = self._settle(task, fingers, contact_of, pose, joints)
        clearances = np.zeros(3)
        if quantities[0] <= TIP_TOLERANCE_M:
            measure_clearances(hand.chains, hand.shapes, task, contact_of, pose, joints, system, clearances)
        measured = np.array([quantities[1], quantities[2], *clearances])
        failed = int(np.array([quantities[0] > TIP_TOLERANCE_M, *(measured < self._margins)]) @ BITS)
        if failed == 0 and links_sink(
            hand.chains, hand.shapes, surroundings.triangles, contact_of, pose, joints, system, DEPTH_M
        ):
            failed = OBJECT
        if failed == 0 and hand.tips_are_links and self._leans(task, contact_of, pose, joints):
            failed = PAD
        comfort = -float(quantities[0]) if failed & TIPS else float(np.min(measured / COMFORT))
        return Attempt(failed, comfort, cost, self._posture(pose, joints, fingers, quantities, clearances))

    def _within_margins(self, fingers: IntArray) -> Chains:
        """Return the chains, those of the used fingers with limits that keep the margin."""
        limits = self._hand.chains.limits.copy()
        # Joints of idle fingers may lead some of the used ones.
        moved = slice(None) if self._by_wrist else fingers
        ranges = limits[moved, :, UPPER] - limits[moved, :, LOWER]
        limits[moved, :, LOWER] += JOINT_BUFFER * self._margins[0] * ranges
        limits[moved, :, UPPER] -= JOINT_BUFFER * self._margins[0] * ranges
        return self._hand.chains._replace(limits=limits)

    def _settle(
        self, task: Task, fingers: IntArray, contact_of: IntArray, pose: FloatArray, joints: FloatArray
    ) -> FloatArray:
        """Bring every tip exactly to its target, in place: by joints alone, or by the wrist too.

        Returns:
            Largest tip error, smallest joint margin, smallest singular value.
        """
        chains = self._hand.chains
        if self._by_wrist:
            inside, hand = self._within_margins(fingers), self._hand
            for sharpness in SHARPNESSES_M if hand.tips_are_links else SHARPNESSES_M[-1:]:
                at = task._replace(limits=_blunted(task.limits, sharpness))
                error = settle(inside, hand.shapes, at, contact_of, pose, joints, self._system, SETTLE_STEPS)
            if error > TIP_TOLERANCE_M:
                return np.array([error, 0.0, 0.0])
            return np.array([error, *self._margins_of(fingers, joints, task.normals @ pose[:, :3])])
        targets = (task.targets - pose[:, 3]) @ pose[:, :3]
        quantities = np.empty((len(fingers), 3, 1))
        for i, f in enumerate(fingers):
            finger_ik_batch(chains, int(f), targets[i : i + 1], joints[f : f + 1], 0.0, quantities[i])
        return np.array([quantities[:, 0].max(), quantities[:, 1].min(), quantities[:, 2].min()])

    def _leans(self, task: Task, contact_of: IntArray, pose: FloatArray, joints: FloatArray) -> bool:
        """Tell whether a tip that is a link is touched too far from its pad's direction."""
        hand = self._hand
        for f, i in enumerate(contact_of):
            if i >= 0:
                pad = hand.last_rotation(f, joints) @ hand.chains.pads[f]
                if -(task.normals[i] @ pose[:, :3]) @ pad < MIN_LEAN:
                    return True
        return False

    def _margins_of(self, fingers: IntArray, joints: FloatArray, normals: FloatArray) -> tuple[float, float]:
        """Return the smallest joint margin and singular value of some fingers, joints by finger.

        The normals of their contacts, palm frame, tell where tips that are links are touched.
        """
        limits, hand = self._hand.chains.limits, self._hand
        if hand.tips_are_links:
            hand = touched(hand, fingers, joints, normals)
        jacobians = hand.tip_jacobians(hand.joint_vector(joints))
        margin, singular = 0.5, np.inf
        for f in fingers:
            count = int(self._hand.chains.counts[f])
            low, high = limits[f, :count, LOWER], limits[f, :count, UPPER]
            own = joints[f, :count]
            margin = min(margin, float(np.min(np.minimum(own - low, high - own) / (high - low))))
            values = np.linalg.svd(jacobians[f], compute_uv=False)
            singular = min(singular, float(values[self._hand.freedom[f] - 1]))
        return margin, singular

    def _posture(
        self,
        pose: FloatArray,
        joints: FloatArray,
        fingers: IntArray,
        quantities: FloatArray,
        clearances: FloatArray,
    ) -> HandPosture:
        transform = np.eye(4)
        transform[:3] = pose
        return HandPosture(
            transform_palm_to_world=transform,
            joints=self._hand.joint_vector(joints),
            fingers=tuple(int(f) for f in fingers),
            tip_error_m=float(quantities[0]),
            joint_margin=float(quantities[1]),
            smallest_singular_value=float(quantities[2]),
            clearance_m=float(min(clearances[0], clearances[1])),
        )
