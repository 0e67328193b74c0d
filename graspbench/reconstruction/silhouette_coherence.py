"""How well silhouettes taken at different times agree when the object is moved as supposed.

The object touches the viewing ray of every point of every outline. So, with all cameras expressed in the
object's frame, each such ray must meet the visual hull of the other silhouettes; by how far it misses it is
the residual (silhouette coherence: Hernandez, Schmitt and Cipolla 2007, there for a turntable).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import cv2
import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.geometry.planar_motion import PlanarMotion
from graspbench.reconstruction.hull_fields import HullFields, build_fields, view_distance

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette

OUTLINE_POINTS = 40
_COARSE = 25
_REACH = 1.3
"""Of the rays beyond the object's radius."""

_INSET_PX = 0.3

_REFINED = 3
_CONSTANT, _VARYING = 3, 6
_ALIKE, _ALIKE_M = 1.1, 0.02e-3
_CLEARLY = 0.85
_ROUNDS = 10
_STEP_M = 0.3e-3


class SilhouetteCoherence:
    """Agreement of time-stamped silhouettes as a function of the object's motion.

    Args:
        silhouettes: With ideal pinhole cameras, world frame.
        times_s: When each was taken, shape (n_img,).
        radius_m: Radius of a ball about the motion's pivot that holds the object.
        ground: Whether the object ends at the plane z = 0.
        outline_points: Rays of each silhouette.
    """

    def __init__(
        self,
        silhouettes: "Sequence[Silhouette]",
        times_s: FloatArray,
        radius_m: float,
        *,
        ground: bool = True,
        outline_points: int = OUTLINE_POINTS,
    ) -> None:
        self.times_s = np.asarray(times_s, dtype=np.float64)
        self.radius_m = radius_m
        self._fields = build_fields(tuple(silhouettes), ground, 0.8)
        self._projections = self._fields.projections.reshape(-1, 3, 4)
        outlines = [_outline(s, outline_points) for s in silhouettes]
        self._counts = np.array([len(points) for points in outlines])
        self._origins = np.array([s.camera.position for s in silhouettes])
        self._directions = np.concatenate(
            [s.camera.rays(points) for s, points in zip(silhouettes, outlines, strict=True)]
        )
        self._views = np.repeat(np.arange(len(silhouettes)), self._counts)

    def residuals(self, motion: PlanarMotion) -> FloatArray:
        """Return by how far each outline ray misses the hull of the other silhouettes, shape (n,), m."""
        moved = motion.displacements(self.times_s)
        rotation, shift = moved[:, :3, :3], moved[:, :3, 3]
        fields = self._fields._replace(projections=np.ascontiguousarray(self._projections @ moved).ravel())
        # Into the object's frame.
        origins = np.einsum("nji,nj->ni", rotation, self._origins - shift)
        directions = np.einsum("nji,nj->ni", rotation[self._views], self._directions)
        out = np.empty(len(self._views))
        _misses(
            fields, origins[self._views], directions, self._views, motion.pivot, _REACH * self.radius_m, out
        )
        return out


def _outline(silhouette: "Silhouette", count: int) -> FloatArray:
    """Return points just inside a silhouette's outline, evenly spread, shape (n, 2), image coordinates."""
    mask = silhouette.mask.astype(np.uint8)
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    longest = max(contours, key=len)[:, 0, :].astype(np.float64) + 0.5
    chosen = np.unique(np.linspace(0, len(longest), count, endpoint=False).astype(np.int64))
    points = longest[chosen]
    inwards = silhouette.centroid - points
    inwards /= np.maximum(np.linalg.norm(inwards, axis=1, keepdims=True), 1e-9)
    inset: FloatArray = points + _INSET_PX * inwards
    return inset


@compiled
def _misses(
    fields: HullFields,
    origins: FloatArray,
    directions: FloatArray,
    views: IntArray,
    centre: FloatArray,
    reach: float,
    out: FloatArray,
) -> None:
    """Find, along each ray, the point that is least outside all other cones."""
    count = len(fields.starts)
    for k in range(len(out)):
        middle = 0.0
        for a in range(3):
            middle += (centre[a] - origins[k, a]) * directions[k, a]
        best, best_at, critical = np.inf, middle, 0
        step = 2.0 * reach / (_COARSE - 1)
        for level in range(4):
            samples = _COARSE if level == 0 else 5
            start = middle if level == 0 else best_at
            for i in range(samples):
                # From the middle outwards: near the truth the first few samples touch the hull.
                at = start + step * (((i + 1) // 2) * (1 - 2 * (i % 2)))
                x = origins[k, 0] + at * directions[k, 0]
                y = origins[k, 1] + at * directions[k, 1]
                z = origins[k, 2] + at * directions[k, 2]
                # The view that decided last comes first: most points are given up after one look.
                largest = fields.ground_m - z
                for turn in range(count + 1):
                    view = critical if turn == 0 else turn - 1
                    if view == views[k] or (turn > 0 and view == critical):
                        continue
                    distance = view_distance(fields, view, x, y, z)
                    if distance > largest:
                        largest = distance
                        if largest >= best:
                            critical = view
                            break
                if largest < best:
                    best, best_at = largest, at
                if best <= 0.0:
                    break
            if best <= 0.0:
                break
            step *= 0.4
        out[k] = max(best, 0.0)


def best_twist(
    coherence: SilhouetteCoherence, starts: Sequence[PlanarMotion], reference_time_s: float
) -> tuple[PlanarMotion, float]:
    """Return the motion, of those near some first guesses, in which the silhouettes agree best.

    A constant twist is fitted first; that it varies is taken for granted only where this makes the
    silhouettes agree clearly better. Of several yaw rates that agree alike, as with a body of revolution, the
    slowest counts.

    Args:
        coherence: The silhouettes.
        starts: First guesses, at least one.
        reference_time_s: The reference time of the result.

    Returns:
        The motion, and the root mean square residual, m.
    """
    guesses = [start.since(reference_time_s) for start in starts]
    ranked = sorted(
        ((motion, _rms(coherence.residuals(motion))) for motion in guesses), key=lambda item: item[1]
    )
    # The slowest of those that look as good as the best, and then the best.
    first = _slowest(ranked)
    others = [item for item in ranked if item[0] is not first[0]][: _REFINED - 1]
    motion, rms = _slowest([_refine(coherence, motion, _CONSTANT) for motion, _ in (first, *others)])
    varying, smaller = _refine(coherence, motion, _VARYING)
    if smaller < _CLEARLY * rms - _ALIKE_M:
        return varying, smaller
    return motion, rms


def _slowest(found: Sequence[tuple[PlanarMotion, float]]) -> tuple[PlanarMotion, float]:
    """Return, of the motions that fit about as well as the best one, the one that turns least."""
    least = min(rms for _, rms in found)
    alike = [item for item in found if item[1] <= _ALIKE * least + _ALIKE_M]
    return min(alike, key=lambda item: abs(item[0].yaw_rate_rad_s))


def _rms(residuals: FloatArray) -> float:
    return float(np.sqrt(np.mean(residuals**2)))


def _refine(coherence: SilhouetteCoherence, start: PlanarMotion, count: int) -> tuple[PlanarMotion, float]:
    """Climb down by Levenberg and Marquardt's method; a unit of each parameter moves the outline by 1 m."""
    span = max(float(np.abs(coherence.times_s - start.reference_time_s).max()), 1e-6)
    scales = np.array(
        [
            1.0 / span,
            1.0 / span,
            1.0 / (span * coherence.radius_m),
            2.0 / span**2,
            2.0 / span**2,
            2.0 / (span**2 * coherence.radius_m),
        ]
    )[:count]

    def moved(values: FloatArray) -> PlanarMotion:
        p = np.zeros(6)
        p[:count] = values * scales
        return replace(
            start,
            velocity_m_s=(start.velocity_m_s[0] + p[0], start.velocity_m_s[1] + p[1]),
            yaw_rate_rad_s=start.yaw_rate_rad_s + p[2],
            velocity_change_m_s2=(
                start.velocity_change_m_s2[0] + p[3],
                start.velocity_change_m_s2[1] + p[4],
            ),
            yaw_acceleration_rad_s2=start.yaw_acceleration_rad_s2 + p[5],
        )

    values, damping = np.zeros(count), 1e-2
    now = coherence.residuals(moved(values))
    for _ in range(_ROUNDS):
        columns = [
            (coherence.residuals(moved(values + step)) - now) / _STEP_M for step in _STEP_M * np.eye(count)
        ]
        jacobian = np.column_stack(columns)
        normal, slope = jacobian.T @ jacobian, jacobian.T @ now
        improved = False
        for _ in range(4):
            shaped = normal + damping * np.diag(np.diag(normal) + 1e-3 * len(now))
            step = -np.linalg.solve(shaped, slope)
            tried = coherence.residuals(moved(values + step))
            if tried @ tried < now @ now:
                improved = bool(tried @ tried < (1.0 - 1e-2) * (now @ now))
                values, now, damping = values + step, tried, 0.3 * damping
                break
            damping *= 5.0
        if not improved:
            break
    return moved(values), _rms(now)
