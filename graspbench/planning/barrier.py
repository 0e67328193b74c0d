"""The kinematic barrier: what the hand thinks of the moves on the contours (thesis 3.4.2).

At every contour point of a contact its finger is solved by inverse kinematics, the palm held still. A point that
brings a joint near its limit, the finger near a singularity, or its links near other fingers, the palm or the
ground, repels the contact with a force that grows as a hyperbola; a point that the finger cannot touch is no move at all.
"""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np
from numba import njit
from pydantic import Field

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.hand.chains import Chains
from graspbench.hand.collision import ground_clearance, hand_clearance, place_finger, place_hand
from graspbench.hand.kinematics import finger_ik, forward, joint_margin, smallest_singular_value
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture
from graspbench.hand.shapes import Shapes
from graspbench.planning.index import Moves, contour_nodes, free_moves
from graspbench.reconstruction.surface import Surface

REACH_TOLERANCE_M = 1e-5
"""A tip further than this from its target does not reach it."""

_CENTRING = 0.02


@dataclass(frozen=True)
class BarrierParameters:
    """Where the kinematic barrier begins; it is infinite at the hand's own margins."""

    joint_margin: Annotated[
        float, Field(gt=0, lt=0.5, description="Distance to a joint limit where f_j begins, share of the range")
    ] = 0.08
    singular_value_m: Annotated[
        float, Field(gt=0, description="Smallest singular value of the tip Jacobian where f_s begins, m/rad")
    ] = 0.012
    clearance_m: Annotated[
        float, Field(gt=0, description="Distance to other fingers, palm and ground where f_c begins")
    ] = 0.006
    strength_n: Annotated[
        float, Field(ge=0, description="Force of each term where it is half-way to the margin")
    ] = 1.0


@dataclass(frozen=True)
class BarrierValues:
    """The three terms at every contour point, N, each of shape (n_f, k); column 0 is the contact itself.

    Attributes:
        nodes: The contour points, -1 where there is none, shape (n_f, k).
        joint: Repulsion by joint limits.
        singularity: Repulsion by finger singularities.
        clearance: Repulsion by fingers, palm and ground.
        reachable: Whether the finger touches the point within all margins.
    """

    nodes: IntArray
    joint: FloatArray
    singularity: FloatArray
    clearance: FloatArray
    reachable: BoolArray

    @property
    def total(self) -> FloatArray:
        """Sum of the terms, shape (n_f, k)."""
        return self.joint + self.singularity + self.clearance


class MoveFinder(Protocol):
    """Tells which moves a hand allows."""

    def moves(self, surface: Surface, vertices: IntArray, posture: HandPosture | None) -> Moves:
        """Return the allowed moves from ``vertices`` with the hand in ``posture``."""
        ...


class FreeMoves:
    """No hand: every contour point is allowed."""

    def moves(self, surface: Surface, vertices: IntArray, posture: HandPosture | None) -> Moves:
        """Return the whole contours."""
        return free_moves(surface, vertices)


class KinematicBarrier:
    """The barrier of one hand over one ground.

    Args:
        hand: The hand.
        ground_height_m: Height of the ground; None for none.
        parameters: Where the terms begin.
    """

    def __init__(self, hand: HandModel, ground_height_m: float | None, parameters: BarrierParameters) -> None:
        self.hand = hand
        self.ground_height_m = ground_height_m
        self.parameters = parameters
        self.evaluations = 0

    def moves(self, surface: Surface, vertices: IntArray, posture: HandPosture | None) -> Moves:
        """Return the reachable moves; without a posture, all of them.

        Args:
            surface: The surface now.
            vertices: Contacts, shape (n_f,).
            posture: The hand, whose palm stays where it is.
        """
        if posture is None:
            return free_moves(surface, vertices)
        values = self.values(surface, vertices, posture)
        force = barrier_force(surface.points, values.nodes, values.total)
        nodes = np.where(values.reachable, values.nodes, -1)
        # Where a finger is now is where it may always stay.
        nodes[:, 0] = vertices
        return Moves(nodes, values.total, force)

    def values(self, surface: Surface, vertices: IntArray, posture: HandPosture) -> BarrierValues:
        """Evaluate the three terms at the contacts and at the contour points around them.

        Args:
            surface: The surface now.
            vertices: Contacts, shape (n_f,).
            posture: The hand, whose palm stays where it is.
        """
        nodes = contour_nodes(surface, vertices)
        queries = np.zeros((*nodes.shape, 4))
        queries[..., 0] = np.inf
        to_world = posture.transform_palm_to_world
        rotation, origin = to_world[:3, :3], to_world[:3, 3]
        flat = nodes[nodes >= 0]
        centres = surface.points[flat] + self.hand.tip_radius_m * surface.normals[flat]
        targets = np.zeros((*nodes.shape, 3))
        targets[nodes >= 0] = (centres - origin) @ rotation
        ground_offset = -np.inf if self.ground_height_m is None else self.ground_height_m - origin[2]
        _query(
            self.hand.chains,
            self.hand.shapes,
            np.asarray(posture.fingers, dtype=np.int64),
            self.hand.by_finger(posture.joints),
            nodes,
            targets,
            np.ascontiguousarray(rotation[2]),
            float(ground_offset),
            self.parameters.clearance_m,
            queries,
        )
        self.evaluations += len(flat)
        return self._terms(nodes, queries)

    def _terms(self, nodes: IntArray, queries: FloatArray) -> BarrierValues:
        margins, p = self.hand.margins, self.parameters
        error, joint, singular, clearance = (queries[..., a] for a in range(4))
        least = max(margins.hand_m, margins.ground_m)
        reachable = (
            (nodes >= 0)
            & (error <= REACH_TOLERANCE_M)
            & (joint > margins.joint)
            & (singular > margins.singular_value_m)
            & (clearance > least)
        )
        terms = (
            hyperbolic_barrier(joint, margins.joint, p.joint_margin, p.strength_n),
            hyperbolic_barrier(singular, margins.singular_value_m, p.singular_value_m, p.strength_n),
            hyperbolic_barrier(clearance, least, p.clearance_m, p.strength_n),
        )
        return BarrierValues(nodes, *(np.where(reachable, term, 0.0) for term in terms), reachable)


def hyperbolic_barrier(value: FloatArray, least: float, safe: float, strength: float) -> FloatArray:
    """Evaluate a hyperbolic barrier: zero from ``safe`` on, ``strength`` half-way, infinite at ``least``.

    Args:
        value: What should stay large: a margin, a singular value, a clearance; any shape.
        least: Where the barrier is infinite; below, it is infinite too.
        safe: Where it begins.
        strength: Its value half-way between the two.
    """
    value = np.asarray(value, dtype=np.float64)
    if safe <= least:
        return np.where(value > least, 0.0, np.inf)
    share = (value - least) / (safe - least)
    with np.errstate(divide="ignore"):
        grown = strength * (1.0 / np.where(share > 0.0, share, 0.0) - 1.0)
    return np.where(share >= 1.0, 0.0, grown)


def barrier_force(points: FloatArray, nodes: IntArray, values: FloatArray) -> FloatArray:
    """Sum the repulsions of the contour points on each contact (thesis 3.4.2).

    Args:
        points: Surface nodes, shape (n_s, 3).
        nodes: Contacts and contour points, shape (n_f, k), -1 for none.
        values: Strength of each repulsion, N, shape (n_f, k); column 0, the contact itself, does not count.

    Returns:
        Forces from the contour points towards the contacts, shape (n_f, 3), N.
    """
    arms = points[nodes[:, :1]] - points[nodes]
    length = np.linalg.norm(arms, axis=-1)
    counts = (nodes >= 0) & (length > 0.0)
    weights = np.where(counts, values / np.where(counts, length, 1.0), 0.0)
    force: FloatArray = np.einsum("ik,ika->ia", weights, arms)
    return force


@njit(cache=True, nogil=True)
def _query(
    chains: Chains,
    shapes: Shapes,
    fingers: IntArray,
    joints: FloatArray,
    nodes: IntArray,
    targets: FloatArray,
    up: FloatArray,
    ground_offset: float,
    cap: float,
    queries: FloatArray,
) -> None:
    """Write tip error, joint margin, singular value and clearance of each finger at each of its targets.

    Only the asked finger moves; the others, where they are now, are obstacles.
    """
    n_f, width = nodes.shape
    count, most = joints.shape
    rotations, origins = np.empty((count, most, 3, 3)), np.empty((count, most, 3))
    tips = np.empty((count, 3))
    size = shapes.finger.size
    shape_rotations, shape_centres = np.empty((size, 3, 3)), np.empty((size, 3))
    place_hand(chains, shapes, joints, rotations, origins, tips, shape_rotations, shape_centres)
    for i in range(n_f):
        f = fingers[i]
        n = chains.counts[f]
        jacobian = np.empty((3, n))
        solved = np.empty(n)
        for c in range(width):
            if nodes[i, c] < 0:
                continue
            for j in range(n):
                solved[j] = joints[f, j]
            queries[i, c, 0] = finger_ik(
                chains, f, targets[i, c], solved, rotations[f], origins[f], jacobian, _CENTRING
            )
            queries[i, c, 1] = joint_margin(chains, f, solved)
            queries[i, c, 2] = smallest_singular_value(jacobian)
            place_finger(shapes, f, rotations[f], origins[f], shape_rotations, shape_centres)
            clearance = hand_clearance(shapes, shape_rotations, shape_centres, f, cap)
            if ground_offset > -np.inf:
                clearance = ground_clearance(
                    shapes, shape_rotations, shape_centres, up, ground_offset, f, clearance
                )
            queries[i, c, 3] = clearance
        forward(chains, f, joints[f], rotations[f], origins[f], tips[f])
        place_finger(shapes, f, rotations[f], origins[f], shape_rotations, shape_centres)
