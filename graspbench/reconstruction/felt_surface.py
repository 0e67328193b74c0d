"""A reconstructed surface corrected by what was felt: its pose as a whole, then its shape near felt points.

What vision got wrong is taken apart in two. A planar pose of the whole surface, a Gaussian about what vision
said, is updated by all felt points together (registration to the surface). What remains of the
felt distances is a displacement of the surface along its normals, a Gaussian process over the surface: near a
felt point the surface goes where it was felt, far from it nothing is known to have changed.
"""

from dataclasses import dataclass, replace

import numpy as np
import trimesh

from graspbench.arrays import FloatArray
from graspbench.reconstruction.snapshot import snapshot
from graspbench.reconstruction.surface import Surface

_ROUNDS = 20
_SETTLED = 1e-7
_LARGEST_OFFSET_M = 0.01
_NEAR_M = 0.5e-3
_FACES = 60
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class PoseBelief:
    """A Gaussian of how the surface really lies on the table: shift along x and y, m, and yaw, rad.

    Attributes:
        pivot: The point that the yaw turns about, shape (3,).
        mean: Shape (3,).
        covariance: Shape (3, 3).
    """

    pivot: FloatArray
    mean: FloatArray
    covariance: FloatArray

    @classmethod
    def prior(cls, pivot: FloatArray, position_std_m: float, yaw_std_rad: float) -> "PoseBelief":
        """Return what is believed before anything is felt."""
        return cls(pivot, np.zeros(3), np.diag([position_std_m, position_std_m, yaw_std_rad]) ** 2)

    @property
    def transform(self) -> FloatArray:
        """The transform from where vision saw the surface to where it is believed to be, shape (4, 4)."""
        return planar_transform(self.pivot, self.mean)

    def sensitivity(self, points: FloatArray, directions: FloatArray) -> FloatArray:
        """Return how shift and yaw move points along directions, shape (n, 3), of points seen by vision."""
        turned = np.cross(_UP, points - self.pivot)
        return np.column_stack((directions[:, :2], np.einsum("ij,ij->i", turned, directions)))

    def expected_square_m2(self, points: FloatArray) -> float:
        """Return the sum of the expected squared errors of some points' places."""
        return float(np.trace(self._weights(points) @ self.covariance))

    def expected_gain_m2(
        self, touched: FloatArray, normals: FloatArray, points: FloatArray, noise_m: float
    ) -> FloatArray:
        """Return by how much touching would lower the expected squared errors of some points' places.

        One touch measures the surface's place along its normal. By the rank-one update of the covariance the
        trace falls by j S A S j' / (j S j' + noise^2), with j the touch's sensitivity, S the covariance and A
        the points' weights: the expected gain of Bayesian experimental design (A-optimality).

        Args:
            touched: Where the surface might be touched, shape (n, 3).
            normals: Outward unit normals there, shape (n, 3).
            points: Whose places matter, the contacts of the grasp, shape (m, 3).
            noise_m: Standard deviation of a felt distance.

        Returns:
            Shape (n,), m^2.
        """
        spread = self.sensitivity(touched, normals) @ self.covariance
        felt = np.einsum("ij,ij->i", spread, self.sensitivity(touched, normals)) + noise_m**2
        gain: FloatArray = np.einsum("ij,jk,ik->i", spread, self._weights(points), spread) / felt
        return gain

    def _weights(self, points: FloatArray) -> FloatArray:
        weights = np.zeros((3, 3))
        for direction in np.eye(3):
            moved = self.sensitivity(points, np.tile(direction, (len(points), 1)))
            weights += moved.T @ moved
        return weights


def planar_transform(pivot: FloatArray, shift: FloatArray) -> FloatArray:
    """Return the transform that turns about a vertical axis through a pivot and then shifts, shape (4, 4).

    Args:
        pivot: Shape (3,).
        shift: Along x and y, m, and yaw, rad, shape (3,).
    """
    c, s = np.cos(shift[2]), np.sin(shift[2])
    pose = np.eye(4)
    pose[:2, :2] = [[c, -s], [s, c]]
    pose[:2, 3] = pivot[:2] + shift[:2] - pose[:2, :2] @ pivot[:2]
    return pose


def updated_belief(prior: PoseBelief, surface: Surface, felt: FloatArray, noise_m: float) -> PoseBelief:
    """Return the most probable pose of a surface when points of it have been felt.

    Gauss and Newton's method: each felt point is to lie on the surface, to first order.

    Args:
        prior: What was believed before.
        surface: As vision saw it.
        felt: Felt points in the world, shape (n, 3).
        noise_m: Standard deviation of a felt distance.
    """
    information = np.linalg.inv(prior.covariance)
    belief = prior
    for _ in range(_ROUNDS):
        offsets, places, normals = _offsets(belief, surface, felt)
        jacobian = belief.sensitivity(places, normals)
        inverse = information + jacobian.T @ jacobian / noise_m**2
        slope = jacobian.T @ offsets / noise_m**2 - information @ (belief.mean - prior.mean)
        step = np.asarray(np.linalg.solve(inverse, slope), dtype=np.float64)
        covariance = np.asarray(np.linalg.inv(inverse), dtype=np.float64)
        belief = PoseBelief(belief.pivot, belief.mean + _in_world(belief, step), covariance)
        if np.abs(step).max() < _SETTLED:
            break
    return belief


def corrected_surface(
    surface: Surface,
    belief: PoseBelief,
    felt: FloatArray,
    *,
    noise_m: float,
    shape_std_m: float,
    length_m: float,
) -> Surface:
    """Return a surface as vision saw it, displaced along its normals to where it was felt.

    The displacement is a Gaussian process with the kernel shape_std^2 exp(-d^2 / 2 length^2), d the distance
    to the felt points; the pose is left out: `PoseBelief.transform` brings the surface to where it is.

    Args:
        surface: As vision saw it.
        belief: Its pose.
        felt: Felt points in the world, shape (n, 3).
        noise_m: Standard deviation of a felt distance.
        shape_std_m: Standard deviation of the displacement where nothing was felt.
        length_m: Length over which it varies.
    """
    if not len(felt):
        return surface
    offsets, places, ways = _offsets(belief, surface, felt)
    among = _kernel(places, places, shape_std_m, length_m) + noise_m**2 * np.eye(len(felt))
    # What an error of the pose that is left would explain is not put down to the shape.
    moving = belief.sensitivity(places, ways)
    among += moving @ belief.covariance @ moving.T
    weights = np.linalg.solve(among, np.clip(offsets, -_LARGEST_OFFSET_M, _LARGEST_OFFSET_M))
    moved = _kernel(surface.points, places, shape_std_m, length_m) @ weights
    points = surface.points + moved[:, None] * surface.normals
    made = snapshot(points, surface.network, iteration=surface.iteration, at_rest=surface.at_rest)
    return replace(made, progress=surface.progress)


def _kernel(a: FloatArray, b: FloatArray, std_m: float, length_m: float) -> FloatArray:
    squares = np.sum((a[:, None] - b[None]) ** 2, axis=2)
    kernel: FloatArray = std_m**2 * np.exp(-0.5 * squares / length_m**2)
    return kernel


def _offsets(
    belief: PoseBelief, surface: Surface, felt: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how far felt points are outside the surface, and they and the way there as vision saw it.

    The way is from the nearest point of the surface, the distance's gradient; very near to it the normal.
    """
    pose = belief.transform
    places = (felt - pose[:3, 3]) @ pose[:3, :3]
    faces = surface.network.faces
    middles = surface.points[faces].mean(axis=1)
    offsets, ways = np.empty(len(places)), np.empty_like(places)
    for k, place in enumerate(places):
        about = np.argsort(np.sum((middles - place) ** 2, axis=1))[:_FACES]
        nearest = trimesh.triangles.closest_point(
            surface.points[faces[about]], np.tile(place, (len(about), 1))
        )
        distances = np.linalg.norm(nearest - place, axis=1)
        face = int(np.argmin(distances))
        corners = faces[about[face]]
        shares = trimesh.triangles.points_to_barycentric(surface.points[corners][None], nearest[face][None])
        normal = np.clip(shares[0], 0.0, 1.0) @ surface.normals[corners]
        normal /= np.linalg.norm(normal)
        way = place - nearest[face]
        side = 1.0 if way @ normal >= 0.0 else -1.0
        offsets[k] = side * distances[face]
        ways[k] = side * way / distances[face] if distances[face] > _NEAR_M else normal
    return offsets, places, ways


def _in_world(belief: PoseBelief, step: FloatArray) -> FloatArray:
    """Return a small step told in the surface's axes in the world's: the yaw so far turns its shift."""
    c, s = np.cos(belief.mean[2]), np.sin(belief.mean[2])
    return np.array([c * step[0] - s * step[1], s * step[0] + c * step[1], step[2]])
