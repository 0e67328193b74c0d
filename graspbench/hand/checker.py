"""Can this hand hold its fingertips at these contacts? The constraint of every grasp planner."""

from itertools import permutations

import numpy as np
import trimesh

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.errors import HandError
from graspbench.hand.chains import PREFERRED
from graspbench.hand.collision import measure_clearances
from graspbench.hand.kinematics import finger_ik_batch
from graspbench.hand.model import HandModel
from graspbench.hand.obstacle import make_obstacle
from graspbench.hand.parameters import Margins
from graspbench.hand.penetration import DEPTH_M, balls_sink, links_sink, triangles_of
from graspbench.hand.placement import improve
from graspbench.hand.posture import HandPosture
from graspbench.hand.reach import pair_limit
from graspbench.hand.starts import approach_directions, rank_starts
from graspbench.hand.task import HEIGHT, Task, make_system
from graspbench.hand.verification import verify_posture

COLD_STARTS = 12
REACH_STEPS, COLD_STEPS, WARM_STEPS = 10, 25, 10
GUIDE_POINTS = 200
TIP_TOLERANCE_M = 1e-5
GOOD_ENOUGH, ENOUGH = 0.5, 3  # a comfort, or a number of feasible postures, that ends a search
HOPELESS_COST = 400.0  # tips stay about 2 cm away
# What is comfortable: joint margin, singular value, clearances to ground, hand and object.
COMFORT = np.array([0.15, 0.02, 0.006, 0.004, 0.002])
BITS = np.array([1, 2, 4, 8, 16, 32])


class GraspChecker:
    """Decides whether a hand with a floating wrist reaches given contacts, and how.

    The ground and the object's surface are obstacles. The same question has the same answer, whatever was
    asked before; only the last failure is remembered, for whoever asks its reason.

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
        self.set_object(None)
        self._assignments: dict[int, IntArray] = {}
        m = self.margins
        self._margins = np.array([m.joint, m.singular_value_m, m.ground_m, m.hand_m, m.object_m])
        height = -np.inf if ground_height_m is None else float(ground_height_m)
        self._limits = np.array([height, m.ground_m, m.hand_m, m.object_m, 2 * hand.tip_radius_m])
        self._rest = hand.by_finger(hand.rest)
        self._tips = hand.tip_positions(hand.preferred)
        self._system = make_system(hand.chains, hand.shapes)

    def set_object(self, points: FloatArray | None, faces: IntArray | None = None) -> None:
        """Set the object's surface that palm and links must keep clear of.

        Args:
            points: Shape (m, 3); None for no object.
            faces: Its triangles, shape (t, 3); without, only the points are obstacles.
        """
        vertices = np.zeros((0, 3)) if points is None else np.asarray(points, dtype=float).reshape(-1, 3)
        self._triangles = triangles_of(vertices, faces)
        centres = vertices[:0] if faces is None else self._triangles.balls[:, :3]
        self._obstacle = make_obstacle(np.concatenate((vertices, centres)))
        # Fewer points guide the search; all of them, and the triangles at last, judge its result.
        stride = max(1, -(-len(self._obstacle.points) // GUIDE_POINTS))
        self._guide = make_obstacle(self._obstacle.points[::stride])
        self._failure: tuple[bytes, int, HandPosture] | None = None

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
        if not np.all(self._outside_object(task.points, task.normals)):
            return "a fingertip would sink into the object beside its contact"
        if gaps.max() > self.pair_limit_m:
            return (
                f"the contacts are {gaps.max() * 1e3:.0f} mm apart, too wide for the hand "
                f"(at most {self.pair_limit_m * 1e3:.0f} mm)"
            )
        bits, posture = self._cold(task)
        if bits == 0:
            return ""
        if bits & 1:
            left = f"{posture.tip_error_m * 1e3:.1f} mm are left"
            return f"no wrist pose brings all fingers to the contacts ({left})"
        clauses = {
            2: "a joint would be at its limit",
            4: "a finger would be near a singularity",
            8: "the hand would hit the ground",
            16: "the fingers would hit each other or the palm",
            32: "the palm or a finger's link would hit the object",
        }
        return next(clause for bit, clause in clauses.items() if bits & bit)

    def vertex_mask(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        """Tell which contacts a fingertip can touch at all (necessary), shape (n,).

        It must not hit the ground, nor sink into the object beside the contact, as it would in a crease.
        """
        points, normals = np.asarray(points, dtype=float), np.asarray(normals, dtype=float)
        free = self._above_ground(points, normals)
        free[free] = self._outside_object(points[free], normals[free])
        return free

    def _above_ground(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        if self.ground_height_m is None:
            return np.ones(len(points), dtype=np.bool_)
        lowest = points[:, 2] + self.hand.tip_radius_m * (normals[:, 2] - 1.0)
        return np.asarray(lowest >= self.ground_height_m + self.margins.ground_m)

    def _outside_object(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        radius, sink = self.hand.tip_radius_m, np.zeros(len(points), dtype=np.bool_)
        balls_sink(self._triangles, points + radius * normals, radius - DEPTH_M, sink)
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
        return Task(targets, points, normals, self._obstacle, self._limits)

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
        """Try several starts: the first posture comfortable enough, or the most comfortable of a few."""
        asked = task.points.tobytes() + task.normals.tobytes()
        if self._failure is not None and self._failure[0] == asked:
            return self._failure[1:]
        grounded = self.ground_height_m is not None
        poses, fingers = rank_starts(
            approach_directions(task.points, task.normals, grounded),
            task.targets,
            self._choices(len(task.points)),
            self._tips,
            task.limits[HEIGHT],
            self._starts,
        )
        preferred = self.hand.chains.limits[:, :, PREFERRED]
        best: tuple[bool, float, int, HandPosture] | None = None
        feasible = 0
        for pose, chosen in zip(poses, fingers, strict=True):
            joints = self._rest.copy()
            joints[chosen] = preferred[chosen]
            bits, score, posture = self._attempt(task, chosen, np.ascontiguousarray(pose), joints, cold=True)
            if best is None or (bits == 0, score) > best[:2]:
                best = (bits == 0, score, bits, posture)
            feasible += bits == 0
            if feasible == ENOUGH or (best[0] and best[1] >= GOOD_ENOUGH):
                break
        assert best is not None
        if best[2]:
            self._failure = (asked, best[2], best[3])
        return best[2], best[3]

    def _warm(self, task: Task, start: HandPosture) -> HandPosture | None:
        if len(start.fingers) != len(task.points):
            return None
        pose = np.array(start.transform_palm_to_world[:3])
        fingers = np.array(start.fingers)
        bits, _, posture = self._attempt(task, fingers, pose, self.hand.by_finger(start.joints), cold=False)
        return None if bits else posture

    def _attempt(
        self, task: Task, fingers: IntArray, pose: FloatArray, joints: FloatArray, *, cold: bool
    ) -> tuple[int, float, HandPosture]:
        """Improve one start; return what it fails (bits), its comfort, and the posture."""
        hand = self.hand
        guide = task._replace(obstacle=self._guide)
        contact_of = np.full(hand.n_fingers, -1, dtype=np.int64)
        contact_of[fingers] = np.arange(len(fingers))
        if cold:
            # Reach first: collisions of a posture that is far off say nothing.
            cost = improve(
                hand.chains, hand.shapes, guide, contact_of, pose, joints, self._system, False, REACH_STEPS
            )
            if cost > HOPELESS_COST:
                error = float(np.sqrt(cost)) * 1e-3
                return (
                    1,
                    -error,
                    self._posture(pose, joints, fingers, np.array([error, 0.0, 0.0]), np.zeros(3)),
                )
        steps = COLD_STEPS if cold else WARM_STEPS
        improve(hand.chains, hand.shapes, guide, contact_of, pose, joints, self._system, True, steps)
        quantities = self._settle(task, fingers, pose, joints)
        clearances = np.zeros(3)
        if quantities[0] <= TIP_TOLERANCE_M:
            measure_clearances(
                hand.chains, hand.shapes, task, contact_of, pose, joints, self._system, clearances
            )
        measured = np.array([quantities[1], quantities[2], *clearances])
        failed = np.array([quantities[0] > TIP_TOLERANCE_M, *(measured < self._margins)])
        if not np.any(failed):
            # Only what would be accepted is worth the exact test.
            failed[5] = links_sink(
                hand.chains,
                hand.shapes,
                self._triangles,
                contact_of,
                pose,
                joints,
                self._system,
                DEPTH_M,
            )
        score = float(np.min(measured / COMFORT)) if not failed[0] else -float(quantities[0])
        return int(failed @ BITS), score, self._posture(pose, joints, fingers, quantities, clearances)

    def _settle(self, task: Task, fingers: IntArray, pose: FloatArray, joints: FloatArray) -> FloatArray:
        """Bring every tip exactly to its target, the wrist at rest; joints change in place.

        Returns:
            Largest tip error, smallest joint margin, smallest singular value.
        """
        chains = self.hand.chains
        targets = (task.targets - pose[:, 3]) @ pose[:, :3]
        quantities = np.empty((len(fingers), 3, 1))
        for i, f in enumerate(fingers):
            finger_ik_batch(chains, int(f), targets[i : i + 1], joints[f : f + 1], 0.0, quantities[i])
        return np.array([quantities[:, 0].max(), quantities[:, 1].min(), quantities[:, 2].min()])

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
            joints=self.hand.joint_vector(joints),
            fingers=tuple(int(f) for f in fingers),
            tip_error_m=float(quantities[0]),
            joint_margin=float(quantities[1]),
            smallest_singular_value=float(quantities[2]),
            clearance_m=float(min(clearances[0], clearances[1])),
        )
