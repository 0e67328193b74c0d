"""A hand anywhere in the world: where its tips are, and whether it stands clear of what is around it."""

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.collision import measure_clearances
from graspbench.hand.model import HandModel
from graspbench.hand.obstacle import make_obstacle
from graspbench.hand.penetration import DEPTH_M, links_sink, triangles_of
from graspbench.hand.task import Task, make_system


class HandProbe:
    """Looks at postures that hold no contacts yet.

    Args:
        hand: The hand.
        ground_height_m: Height of the ground; None for none.
        points: The object's surface in the world, shape (n, 3), m.
        faces: Its triangles, shape (t, 3).
    """

    def __init__(
        self, hand: HandModel, ground_height_m: float | None, points: FloatArray, faces: IntArray
    ) -> None:
        self._hand, self._system = hand, make_system(hand.chains, hand.shapes)
        self._triangles = triangles_of(points, faces)
        height = -np.inf if ground_height_m is None else float(ground_height_m)
        nothing = np.zeros((0, 3))
        limits = np.array([height, 0.0, 0.0, 0.0, 0.0])
        self._task = Task(nothing, nothing, nothing, make_obstacle(nothing), limits)
        self._margins = hand.margins
        self._tips_free = np.full(hand.n_fingers, -1, dtype=np.int64)
        self._tips_ignored = np.arange(hand.n_fingers, dtype=np.int64)
        self._clearances = np.zeros(3)

    def tips(self, transform_palm_to_world: FloatArray, joints: FloatArray) -> FloatArray:
        """Return the tips' centres in the world, shape (n_f, 3), m; joints of shape (n_q,)."""
        own = self._hand.tip_positions(joints)
        tips: FloatArray = own @ transform_palm_to_world[:3, :3].T + transform_palm_to_world[:3, 3]
        return tips

    def is_clear(self, transform_palm_to_world: FloatArray, joints: FloatArray) -> bool:
        """Tell whether palm and links are outside object, ground and each other; tips may touch the object.

        Args:
            transform_palm_to_world: Pose of the palm, shape (4, 4).
            joints: Shape (n_q,), rad.
        """
        hand, pose = self._hand, np.ascontiguousarray(transform_palm_to_world[:3])
        rows, out = hand.by_finger(joints), self._clearances
        measure_clearances(
            hand.chains, hand.shapes, self._task, self._tips_free, pose, rows, self._system, out
        )
        if out[0] < self._margins.ground_m or out[1] < self._margins.hand_m:
            return False
        return not links_sink(
            hand.chains,
            hand.shapes,
            self._triangles,
            self._tips_ignored,
            pose,
            rows,
            self._system,
            DEPTH_M,
        )
