"""The kinematic barrier: what the hand thinks of the moves on the contours (thesis 3.4.2).

At every contour point of a contact its finger is solved by inverse kinematics, the palm held still. A point
that brings a joint near its limit, the finger near a singularity, or its links near other fingers, the palm
or the ground, repels the contact with a force that grows as a hyperbola. A point that the finger cannot
touch repels most, and is no move at all.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.hand.chains import Chains
from graspbench.hand.collision import ground_clearance, hand_clearance, place_hand, place_shapes
from graspbench.hand.kinematics import finger_ik, forward, joint_margin, smallest_singular_value
from graspbench.hand.model import HandModel
from graspbench.hand.posture import HandPosture
from graspbench.hand.shapes import Shapes
from graspbench.planning.index import Moves, contour_nodes, free_moves
from graspbench.planning.parameters import BarrierParameters
from graspbench.reconstruction.surface import Surface

REACH_TOLERANCE_M = 1e-5
"""A tip further than this from its target does not reach it."""

MAX_REPULSION = 10.0
"""Where a term is cut off, in strengths: what a point beyond the margin, or out of reach, repels with."""

_CENTRING = 0.02


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
        if posture is None or self.hand.places_by_wrist:  # its contours say nothing with a still palm
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
        terms = np.zeros((3, *nodes.shape))
        reachable = np.zeros(nodes.shape, dtype=np.bool_)
        to_world = posture.transform_palm_to_world
        height = -np.inf if self.ground_height_m is None else self.ground_height_m
        margins, p = self.hand.margins, self.parameters
        ranges = np.array(
            [
                [margins.joint, p.joint_margin],
                [margins.singular_value_m, p.singular_value_m],
                [max(margins.hand_m, margins.ground_m), p.clearance_m],
            ]
        )
        self.evaluations += _evaluate(
            self.hand.chains,
            self.hand.shapes,
            np.array(posture.fingers, dtype=np.int64),
            self.hand.by_finger(posture.joints),
            np.ascontiguousarray(to_world[:3]),
            float(height),
            self.hand.tip_radius_m,
            surface.points,
            surface.normals,
            nodes,
            ranges,
            p.strength_n,
            terms,
            reachable,
        )
        return BarrierValues(nodes, terms[0], terms[1], terms[2], reachable)


@compiled
def hyperbolic_barrier(value: float, least: float, safe: float, strength: float) -> float:
    """Evaluate a hyperbolic barrier: zero from ``safe`` on, ``strength`` half-way, infinite at ``least``.

    Args:
        value: What should stay large: a margin, a singular value, a clearance.
        least: Where the barrier is infinite; below, it is infinite too.
        safe: Where it begins.
        strength: Its value half-way between the two.
    """
    if value <= least:
        return np.inf
    if value >= safe:
        return 0.0
    return strength * ((safe - least) / (value - least) - 1.0)


def barrier_force(points: FloatArray, nodes: IntArray, values: FloatArray) -> FloatArray:
    """Sum the repulsions of the contour points on each contact (thesis 3.4.2).

    Args:
        points: Surface nodes, shape (n_s, 3).
        nodes: Contacts and contour points, shape (n_f, k), -1 for none.
        values: Strength of each repulsion, N, shape (n_f, k); column 0, the contact itself, does not count.

    Returns:
        Forces from the contour points towards the contacts, shape (n_f, 3), N.
    """
    force = np.zeros((len(nodes), 3))
    _add_repulsions(points, nodes, np.ascontiguousarray(values), force)
    return force


@compiled
def _add_repulsions(points: FloatArray, nodes: IntArray, values: FloatArray, force: FloatArray) -> None:
    for i in range(nodes.shape[0]):
        for c in range(1, nodes.shape[1]):
            if nodes[i, c] < 0 or values[i, c] == 0.0:
                continue
            length = 0.0
            for a in range(3):
                length += (points[nodes[i, 0], a] - points[nodes[i, c], a]) ** 2
            if length == 0.0:
                continue
            length = np.sqrt(length)
            for a in range(3):
                force[i, a] += values[i, c] * (points[nodes[i, 0], a] - points[nodes[i, c], a]) / length


@compiled
def _evaluate(
    chains: Chains,
    shapes: Shapes,
    fingers: IntArray,
    joints: FloatArray,
    palm: FloatArray,
    ground_height: float,
    tip_radius: float,
    points: FloatArray,
    normals: FloatArray,
    nodes: IntArray,
    ranges: FloatArray,
    strength: float,
    terms: FloatArray,
    reachable: BoolArray,
) -> int:
    """Write the terms of every contour point, and which are reachable; return the number of points.

    Only the asked finger moves; the others, where they are now, are obstacles.
    """
    n_f, width = nodes.shape
    count, most = joints.shape
    frames, tips, target = np.empty((count, most, 3, 4)), np.empty((count, 3)), np.empty(3)
    poses = np.empty((shapes.index.shape[0], 3, 4))
    place_hand(chains, shapes, joints, frames, tips, poses)
    evaluated = 0
    for i in range(n_f):
        f = fingers[i]
        n = chains.counts[f]
        jacobian, solved = np.empty((3, n)), np.empty(n)
        for c in range(width):
            node = nodes[i, c]
            if node < 0:
                continue
            evaluated += 1
            for a in range(3):
                target[a] = 0.0
                for b in range(3):
                    target[a] += palm[b, a] * (points[node, b] + tip_radius * normals[node, b] - palm[b, 3])
            for j in range(n):
                solved[j] = joints[f, j]
            error = finger_ik(chains, f, target, solved, frames[f], jacobian, _CENTRING)
            if error > REACH_TOLERANCE_M:
                terms[0, i, c] = MAX_REPULSION * strength
                continue
            place_shapes(shapes, f, frames[f], poses)
            clearance = hand_clearance(shapes, poses, f, ranges[2, 1])
            if ground_height > -np.inf:
                clearance = ground_clearance(shapes, poses, palm, ground_height, f, clearance)
            margin = joint_margin(chains, f, solved)
            singular = smallest_singular_value(jacobian)
            reachable[i, c] = margin > ranges[0, 0] and singular > ranges[1, 0] and clearance > ranges[2, 0]
            for term, value in enumerate((margin, singular, clearance)):
                grown = hyperbolic_barrier(value, ranges[term, 0], ranges[term, 1], strength)
                terms[term, i, c] = min(grown, MAX_REPULSION * strength)
        forward(chains, f, joints[f], frames[f], tips[f])
        place_shapes(shapes, f, frames[f], poses)
    return evaluated
