"""A search problem, laid out for compiled code."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.grasp.closure import CLOSURE_TOLERANCE
from graspbench.grasp.contact import ContactPolytope
from graspbench.grasp.epsilon import smallest_support
from graspbench.grasp.quality import QualityParameters, singular_measures
from graspbench.grasp.wrench import grasp_matrix, wrench_maps
from graspbench.planning.search.tables import even_directions, support_table, weaken_directions
from graspbench.planning.search.tree import ClusterTree, build_tree

NORMAL_WEIGHT = 0.3
EVEN_DIRECTIONS, WEAK_DIRECTIONS = 256, 768
SAMPLES = 4096


@dataclass(frozen=True, eq=False)
class Layout:
    """The usable nodes of a surface in the order of a cluster tree's leaves.

    Attributes:
        nodes: Their indices on the surface, shape (n,).
        points: Shape (n, 3), m.
        normals_in: Inward unit normals, shape (n, 3).
        centroid: Shape (3,), m.
        torque_length: m.
        quality: Contact model and wrench space.
        tree: Clusters of the nodes; its members are 0 to n - 1 in order.
        n_f: Number of contacts.
        limits: Largest distance of two contacts, and of their mean from the centroid, m; shape (2,).
        n_nodes: Number of nodes of the surface, n_s.
    """

    nodes: IntArray
    points: FloatArray
    normals_in: FloatArray
    centroid: FloatArray
    torque_length: float
    quality: QualityParameters
    tree: ClusterTree
    n_f: int
    limits: FloatArray
    n_nodes: int

    @property
    def planar(self) -> bool:
        """Whether the wrench space depends on the grasp's plane."""
        return self.quality.wrench_space.startswith("planar")

    @property
    def polytope(self) -> ContactPolytope:
        """The linearised unit friction cone."""
        return self.quality.polytope(self.torque_length)

    @cached_property
    def maps(self) -> FloatArray:
        """Spatial wrench maps, shape (n, d, n_basis); d is 3 when forces alone count."""
        maps = wrench_maps(
            self.points,
            self.normals_in,
            self.centroid,
            contact=self.quality.contact,
            torque_length=self.torque_length,
        )
        return maps[:, :3] if self.quality.wrench_space.endswith("_force") else maps

    @cached_property
    def wrenches(self) -> FloatArray:
        """Unit cone wrenches, shape (n, n_vertices, d)."""
        return np.ascontiguousarray(self.polytope.vertices @ np.swapaxes(self.maps, -1, -2))

    @cached_property
    def grams(self) -> FloatArray:
        """Upper triangle of each contact's share of G G^T, off-diagonals doubled; (n, d (d + 1) / 2)."""
        shares = self.maps @ np.swapaxes(self.maps, -1, -2)
        rows, columns = np.triu_indices(shares.shape[-1])
        return np.ascontiguousarray(shares[:, rows, columns] * np.where(rows == columns, 1.0, 2.0))

    @cached_property
    def directions(self) -> FloatArray:
        """Directions of the support table, shape (n_directions, d): even ones and weak ones of grasps."""
        even = even_directions(EVEN_DIRECTIONS, self.maps.shape[1])
        grasps = self.sample(SAMPLES)
        if self.planar or not len(grasps):
            return even
        supports = (self.wrenches @ even.T).max(axis=1)[grasps].max(axis=1)
        promising = np.argsort(-supports.min(axis=1), kind="stable")[:WEAK_DIRECTIONS]
        weak = even[supports[promising].argmin(axis=1)]
        weaken_directions(self.wrenches, grasps[promising], weak)
        return np.vstack([even, weak])

    @cached_property
    def table(self) -> FloatArray:
        """Support of every cluster in every direction, shape (n_clusters, n_directions)."""
        return support_table(self.tree, self.wrenches, self.directions)

    @cached_property
    def branches(self) -> IntArray:
        """Children, first member and end of each cluster, shape (n_clusters, 4)."""
        return np.hstack([self.tree.children, self.tree.span])

    @cached_property
    def balls(self) -> FloatArray:
        """Centre and radius of each cluster's arms, shape (n_clusters, 4), torque lengths."""
        return np.hstack([self.tree.arm, self.tree.arm_radius[:, None]])

    @cached_property
    def in_order(self) -> IntArray:
        """The leaves in the order of their nodes on the surface, shape (n,)."""
        return np.argsort(self.nodes)

    @cached_property
    def leaf_of(self) -> IntArray:
        """The leaf of each node of the surface, -1 where one is not usable, shape (n_s,)."""
        leaf_of = np.full(self.n_nodes, -1, dtype=np.int64)
        leaf_of[self.nodes] = np.arange(len(self.nodes))
        return leaf_of

    def leaves_of(self, nodes: IntArray) -> IntArray | None:
        """Return the leaves of a grasp's nodes, shape (n_f,); None if one of them is not usable."""
        leaves = self.leaf_of[nodes]
        return None if leaves.min() < 0 else leaves

    def sample(self, count: int) -> IntArray:
        """Return some of ``count`` random grasps: those within the limits, shape (m, n_f)."""
        grasps = np.random.default_rng(2010).integers(0, len(self.nodes), size=(count, self.n_f))
        return grasps[self.within_limits(grasps)]

    def within_limits(self, tuples: IntArray) -> BoolArray:
        """Tell which grasps (leaves, shape (m, n_f)) have different contacts that meet the limits; (m,)."""
        points, n_f = self.points, tuples.shape[1]
        mean = sum(points[tuples[:, i]] for i in range(n_f)) / n_f
        allowed = np.linalg.norm(mean - self.centroid, axis=1) <= self.limits[1]
        for i, j in combinations(range(n_f), 2):
            gap = points[tuples[:, i]] - points[tuples[:, j]]
            allowed &= np.einsum("ij,ij->i", gap, gap) <= self.limits[0] ** 2
            allowed &= tuples[:, i] != tuples[:, j]
        return np.asarray(allowed)

    def grasp_maps(self, tuples: IntArray) -> FloatArray:
        """Return the wrench maps of grasps, shape (m, n_f, d, n_basis), in the wrench space."""
        if not self.planar:
            return self.maps[tuples]
        return wrench_maps(
            self.points[tuples],
            self.normals_in[tuples],
            self.centroid,
            contact=self.quality.contact,
            wrench_space=self.quality.wrench_space,
            torque_length=self.torque_length,
        )

    def singular(self, tuples: IntArray, measure: str) -> FloatArray:
        """Return q1 or q2 of grasps, force closure or not, shape (m,)."""
        return singular_measures(grasp_matrix(self.grasp_maps(tuples)))[measure == "q2"]

    def measure(self, tuples: IntArray, measure: str, floor: float) -> FloatArray:
        """Return q1, q2 or q3 of grasps, shape (m,); -inf where one is not force closure.

        Values at or below ``floor`` need not be exact.
        """
        values = np.full(len(tuples), -np.inf)
        if measure == "q3" and self.quality.norm == "l1":
            radius = self._reach(tuples, max(floor, CLOSURE_TOLERANCE))
            closed = radius > max(floor, CLOSURE_TOLERANCE)
            values[closed] = radius[closed]
            return values
        if measure != "q3":
            promise = self.singular(tuples, measure)
            chosen = np.flatnonzero(promise > floor)
        else:
            chosen = np.arange(len(tuples))
        chosen = chosen[self._reach(tuples[chosen], CLOSURE_TOLERANCE) > CLOSURE_TOLERANCE]
        values[chosen] = self._reach(tuples[chosen], floor, True) if measure == "q3" else promise[chosen]
        return values

    def _reach(self, tuples: IntArray, stop_at: float, minkowski: bool = False) -> FloatArray:
        polytope = self.polytope
        wrenches = polytope.vertices @ np.swapaxes(self.grasp_maps(tuples), -1, -2)
        return smallest_support(wrenches, polytope, minkowski=minkowski, stop_at=stop_at)


def lay_out(
    points: FloatArray,
    normals_in: FloatArray,
    centroid: FloatArray,
    quality: QualityParameters,
    torque_length: float,
    usable: IntArray,
    n_f: int,
    limits: FloatArray,
) -> Layout:
    """Cluster the usable nodes of a surface.

    Args:
        points: Surface nodes, shape (n_s, 3), m.
        normals_in: Inward unit normals, shape (n_s, 3).
        centroid: Shape (3,), m.
        quality: Contact model and wrench space.
        torque_length: m.
        usable: Indices of the nodes that a finger may touch, shape (n,).
        n_f: Number of contacts.
        limits: Largest distance of two contacts, and of their mean from the centroid, m; shape (2,).
    """
    tree = build_tree((points[usable] - centroid) / torque_length, normals_in[usable], NORMAL_WEIGHT)
    nodes = usable[tree.members]
    return Layout(
        nodes, points[nodes], normals_in[nodes], centroid, torque_length, quality, tree, n_f, limits,
        len(points),
    )  # fmt: skip


def single_grasps(layout: Layout, tuples: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the only grasp of each tuple of clusters with one node, as leaves, with no bound."""
    return layout.tree.span[tuples, 0], np.full(len(tuples), np.inf)
