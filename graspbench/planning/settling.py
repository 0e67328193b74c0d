"""One grasp that the planner moves over the surface until no finger wants to move."""

from dataclasses import dataclass, field

import numpy as np

from graspbench.arrays import IntArray
from graspbench.hand.posture import HandPosture
from graspbench.planning.barrier import MoveFinder
from graspbench.planning.constraint import Placer
from graspbench.planning.index import Index, Moves
from graspbench.reconstruction.carrying import carry_over
from graspbench.reconstruction.surface import Surface

MAX_REFUSED = 8
"""Configurations refused by the hand on one walk after which it ends: a search in vain costs most."""


@dataclass(frozen=True)
class Settler:
    """What moves a grasp: an index, and the hand that limits it.

    Attributes:
        index: Proposes the moves.
        finder: Knows which moves the hand allows.
        placer: Solves the whole hand; None without a hand.
        max_moves: Proposals on one surface after which it stops.
        wrist_moves: Moves after which the wrist follows the fingers.
    """

    index: Index
    finder: MoveFinder
    placer: Placer | None
    max_moves: int
    wrist_moves: int


@dataclass
class Follower:
    """A grasp on its way, with what it took.

    Attributes:
        vertices: Where the fingers are, shape (n_f,).
        posture: The hand there; None when there is none, or none was found.
        via: Surface and vertices of every configuration on the way.
        moves: Number of moves.
        evaluations: Number of proposals asked from the index.
        cycles: Number of times that the index wanted back to a configuration it had left.
        followed: Where the fingers were before the last surface, shape (n_f,); None before the second one.
        rough: Where they were on the surface at rest before they were polished; None if they were not.
    """

    vertices: IntArray
    posture: HandPosture | None = None
    via: list[tuple[Surface, IntArray]] = field(default_factory=list)
    moves: int = 0
    evaluations: int = 0
    cycles: int = 0
    followed: IntArray | None = None
    rough: IntArray | None = None


def arrive(follower: Follower, surface: Surface) -> None:
    """Bring a grasp onto a surface; it moves on to other nodes only where the network is another."""
    if follower.via and follower.via[-1][0].network is not surface.network:
        follower.vertices = carry_over(follower.vertices, follower.via[-1][0], surface)
        follower.via.append((surface, follower.vertices))


def settle(follower: Follower, surface: Surface, settler: Settler, *, placed: bool = False) -> bool:
    """Move a grasp on one surface until the index finds no better move that the hand can follow.

    The wrist follows every few moves; in between, the barrier tells what the fingers reach with the palm
    held still. When the wrist cannot follow, the grasp goes back to where it last could, and goes on one
    checked move at a time. On a surface that is not at rest yet an infeasible grasp is passed on as it is.

    Args:
        follower: Changed in place.
        surface: The surface now.
        settler: Index and hand.
        placed: Whether the follower's posture holds it on this surface already.

    Returns:
        Whether the grasp now is feasible for the hand (always True without a hand).
    """
    arrive(follower, surface)
    walk = _Walk(follower, surface, settler)
    walk.run(placed=placed)
    return settler.placer is None or follower.posture is not None


class _Walk:
    """The moves on one surface."""

    def __init__(self, follower: Follower, surface: Surface, settler: Settler) -> None:
        self.follower = follower
        self.surface = surface
        self.settler = settler
        self.path: list[IntArray] = [follower.vertices]
        self.visited = {tuple(follower.vertices.tolist())}
        self.banned: set[tuple[int, int]] = set()
        self.careful = False
        self.placed_at = 0
        self.refused = 0

    def run(self, *, placed: bool) -> None:
        follower, settler = self.follower, self.settler
        follower.via.append((self.surface, follower.vertices))
        if not placed:
            follower.posture = self._place(follower.vertices)
        for _ in range(settler.max_moves):
            if self.refused >= MAX_REFUSED:
                break
            moves = settler.finder.moves(self.surface, follower.vertices, follower.posture)
            proposed = settler.index.propose(self.surface, follower.vertices, self._without_banned(moves))
            follower.evaluations += 1
            cycle = proposed is not None and tuple(proposed.tolist()) in self.visited
            follower.cycles += cycle
            if proposed is None or cycle:
                if self._is_placed() or not self._follow() or cycle:
                    break
            elif self.careful:
                self._move_checked(proposed)
            else:
                self._move(proposed)
                if len(self.path) - 1 - self.placed_at >= settler.wrist_moves:
                    self._follow()
        if not self._is_placed():
            self._follow()

    def _move(self, vertices: IntArray) -> None:
        self.follower.vertices = vertices
        self.follower.moves += 1
        self.follower.via.append((self.surface, vertices))
        self.path.append(vertices)
        self.visited.add(tuple(vertices.tolist()))
        self.banned.clear()

    def _move_checked(self, vertices: IntArray) -> None:
        """Move only where the whole hand can follow; else take these moves out."""
        posture = self._place(vertices)
        if posture is None:
            changed = np.flatnonzero(vertices != self.follower.vertices)
            self.banned.update((int(i), int(vertices[i])) for i in changed)
            return
        self._move(vertices)
        self.follower.posture = posture
        self.placed_at = len(self.path) - 1

    def _follow(self) -> bool:
        """Let the wrist follow the fingers; False when the walk should end."""
        posture = self._place(self.follower.vertices)
        if posture is not None:
            self.follower.posture = posture
            self.placed_at = len(self.path) - 1
            return True
        if not self.surface.at_rest:
            self.follower.posture = None
            self.placed_at = len(self.path) - 1
            return False
        return self._go_back()

    def _go_back(self) -> bool:
        """Return to the last configuration that the hand can take; False when there is none."""
        follower = self.follower
        for step in range(len(self.path) - 2, -1, -1):
            known = step == self.placed_at and follower.posture is not None
            if not known and self.refused >= MAX_REFUSED:
                continue
            posture = follower.posture if known else self._place(self.path[step])
            if posture is not None:
                follower.vertices, follower.posture = self.path[step], posture
                follower.via.append((self.surface, follower.vertices))
                del self.path[step + 1 :]
                self.visited = {tuple(v.tolist()) for v in self.path}
                self.placed_at = step
                self.careful = True
                return True
        follower.posture = None
        self.placed_at = len(self.path) - 1
        return False

    def _place(self, vertices: IntArray) -> HandPosture | None:
        if self.settler.placer is None:
            return None
        points, normals = self.surface.points[vertices], self.surface.normals[vertices]
        posture = self.settler.placer.place(points, normals, start=self.follower.posture)
        self.refused += posture is None
        return posture

    def _is_placed(self) -> bool:
        return self.settler.placer is None or (
            self.placed_at == len(self.path) - 1
            and (self.follower.posture is not None or len(self.path) == 1)
        )

    def _without_banned(self, moves: Moves) -> Moves:
        if not self.banned:
            return moves
        nodes = moves.nodes.copy()
        for i, node in self.banned:
            nodes[i, 1:][nodes[i, 1:] == node] = -1
        return Moves(nodes, moves.barrier, moves.barrier_force)
