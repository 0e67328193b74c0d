"""A search problem, laid out for compiled code."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.grasp.closure import CLOSURE_TOLERANCE
from graspbench.grasp.epsilon import smallest_support
from graspbench.grasp.quality import QualityParameters, singular_measures
from graspbench.grasp.wrench import grasp_matrix, wrench_maps
from graspbench.planning.search.tables import support_table, wrench_directions
from graspbench.planning.search.tree import ClusterTree, build_tree

NORMAL_WEIGHT = 0.3
DIRECTIONS = 1024


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
    """

    nodes: IntArray
    points: FloatArray
    normals_in: FloatArray
    centroid: FloatArray
    torque_length: float
    quality: QualityParameters
    tree: ClusterTree

    @property
    def planar(self) -> bool:
        """Whether the wrench space depends on the grasp's plane."""
        return self.quality.wrench_space.startswith("planar")

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
        return np.ascontiguousarray(self.quality.polytope().vertices @ np.swapaxes(self.maps, -1, -2))

    @cached_property
    def grams(self) -> FloatArray:
        """Upper triangle of each contact's share of G G^T, off-diagonals doubled; (n, d (d + 1) / 2)."""
        shares = self.maps @ np.swapaxes(self.maps, -1, -2)
        rows, columns = np.triu_indices(shares.shape[-1])
        return np.ascontiguousarray(shares[:, rows, columns] * np.where(rows == columns, 1.0, 2.0))

    @cached_property
    def directions(self) -> FloatArray:
        """Directions of the support table, shape (n_directions, d)."""
        return wrench_directions(DIRECTIONS, self.maps.shape[1])

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

    def measure(self, tuples: IntArray, measure: str, floor: float) -> FloatArray:
        """Return q1, q2 or q3 of grasps, shape (m,); -inf where one is not force closure.

        Values at or below ``floor`` need not be exact.
        """
        polytope = self.quality.polytope()
        maps = self.grasp_maps(tuples)
        wrenches = polytope.vertices @ np.swapaxes(maps, -1, -2)
        l1 = measure == "q3" and self.quality.norm == "l1"
        enough = max(floor, CLOSURE_TOLERANCE) if l1 else CLOSURE_TOLERANCE
        radius = smallest_support(wrenches, polytope, stop_at=enough)
        closed = radius > enough
        values = np.full(len(tuples), -np.inf)
        if l1:
            values[closed] = radius[closed]
        elif measure == "q3":
            values[closed] = smallest_support(wrenches[closed], polytope, minkowski=True, stop_at=floor)
        else:
            pair = singular_measures(grasp_matrix(maps[closed]))
            values[closed] = pair[0] if measure == "q1" else pair[1]
        return values


def lay_out(
    points: FloatArray,
    normals_in: FloatArray,
    centroid: FloatArray,
    quality: QualityParameters,
    torque_length: float,
    usable: IntArray,
) -> Layout:
    """Cluster the usable nodes of a surface.

    Args:
        points: Surface nodes, shape (n_s, 3), m.
        normals_in: Inward unit normals, shape (n_s, 3).
        centroid: Shape (3,), m.
        quality: Contact model and wrench space.
        torque_length: m.
        usable: Indices of the nodes that a finger may touch, shape (n,).
    """
    tree = build_tree((points[usable] - centroid) / torque_length, normals_in[usable], NORMAL_WEIGHT)
    nodes = usable[tree.members]
    return Layout(nodes, points[nodes], normals_in[nodes], centroid, torque_length, quality, tree)
