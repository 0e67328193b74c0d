"""What a hand has to do, and the numbers of the optimisation that does it."""

from typing import Any, NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.chains import Chains
from graspbench.hand.obstacle import Obstacle
from graspbench.hand.shapes import Shapes

HEIGHT, GROUND, HAND, OBJECT, EXEMPT, SHARPNESS = 0, 1, 2, 3, 4, 5
TURN, GAP = 11, 14
WORLD: Any = np.int64(-2)  # a plain -2 would be a type of its own to the compiler


class Task(NamedTuple):
    """What the hand has to reach and to avoid, in the world.

    Attributes:
        targets: Wanted tip centres, shape (m, 3).
        points: Contact points, shape (m, 3).
        normals: Outward unit normals, shape (m, 3).
        obstacle: Points of the object's surface.
        limits: Height of the ground (-inf: none); margins to ground, hand and object; the last link of a
            finger may come near object points within the next number of its own contact; the soft maximum's
            tau of tips that have their links' shapes; shape (6,).
    """

    targets: FloatArray
    points: FloatArray
    normals: FloatArray
    obstacle: Obstacle
    limits: FloatArray


class System(NamedTuple):
    """The hand at one posture, what acts on it, and the normal equations.

    Attributes:
        frames: Joint frames, shape (f, k, 3, 4).
        tips: Tip centres, shape (f, 3).
        poses: Poses of the shapes, shape (s, 3, 4).
        gaps: Distances along a direction between two points, each on a body, and what they should be:
            residual, weight, direction (3), point a (3), point b (3), and the residual's derivative by the
            turn of body a seen from the world (3), shape (r, 14).
        bodies: Finger and link of point a, then of point b (PALM, or WORLD at rest outside), shape (r, 4).
        hessian: Shape (n, n), n = 6 + f k: the wrist's twist, then the joints by finger; lower half.
        gradient: Downhill, shape (n,).
        best_hessian: The Hessian at the best posture so far, shape (n, n).
        best_gradient: The gradient there, shape (n,).
        row: The row under construction, shape (n,).
        step: The step, shape (n,).
        factor: Cholesky factor, shape (n, n).
        frozen: 1 for unknowns that a step leaves alone, shape (n,).
        best_pose: Best pose so far, shape (3, 4).
        best_joints: Its joints, shape (f, k).
        exempt: Work space, shape (3,).
        touch: Work space of ``tip_support.support``, shape (12,).
    """

    frames: FloatArray
    tips: FloatArray
    poses: FloatArray
    gaps: FloatArray
    bodies: IntArray
    hessian: FloatArray
    gradient: FloatArray
    best_hessian: FloatArray
    best_gradient: FloatArray
    row: FloatArray
    step: FloatArray
    factor: FloatArray
    frozen: FloatArray
    best_pose: FloatArray
    best_joints: FloatArray
    exempt: FloatArray
    touch: FloatArray


def make_system(chains: Chains, shapes: Shapes) -> System:
    """Allocate the numbers for a hand."""
    n, k = chains.index.shape
    s, size = len(shapes.index), 6 + n * k
    most = 4 * n + 3 * s + len(shapes.pairs)
    return System(
        frames=np.zeros((n, k, 3, 4)),
        tips=np.zeros((n, 3)),
        poses=np.zeros((s, 3, 4)),
        gaps=np.zeros((most, GAP)),
        bodies=np.zeros((most, 4), dtype=np.int64),
        hessian=np.zeros((size, size)),
        gradient=np.zeros(size),
        best_hessian=np.zeros((size, size)),
        best_gradient=np.zeros(size),
        row=np.zeros(size),
        step=np.zeros(size),
        factor=np.zeros((size, size)),
        frozen=np.zeros(size),
        best_pose=np.zeros((3, 4)),
        best_joints=np.zeros((n, k)),
        exempt=np.zeros(3),
        touch=np.zeros(12),
    )
