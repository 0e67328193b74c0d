"""Limit surfaces of soft pads in a quadratic programme: planes where they are needed, patches that fit."""

from collections.abc import Iterator, Sequence

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.soft_pad import PadParameters

_TOLERANCE = 1e-4


class LimitSurfaces:
    """Planes that touch the ellipsoids |f_t|^2 / mu^2 + tau^2 / e^2 <= N^2 of all pads, with e as loaded.

    A solution outside an ellipsoid gets the plane that touches it there, until all are inside: fewer planes
    than a fine polyhedron has, and the ellipsoid itself instead of a polyhedron. The patches, and so e,
    follow the normal forces of the solution before; that converges, since none grows faster than N^(1/3).

    Args:
        spans: Unknowns of each pad: normal force, two tangential forces, and the torque about the normal over
            what a pad bears of it per newton under its nominal load.
        count: Number of all unknowns.
        friction: Friction coefficient mu.
        pad: The pads.
    """

    def __init__(self, spans: Sequence[slice], count: int, friction: float, pad: PadParameters) -> None:
        self._spans, self._count, self._friction, self._pad = spans, count, friction, pad
        self._unit_m = pad.torsion_m(pad.load_n, friction)
        self._torsions_m = [self._unit_m] * len(spans)
        axes = np.vstack([np.eye(3), -np.eye(3)])
        self._directions = [list(axes) for _ in spans]

    def rows(self) -> Iterator[FloatArray]:
        """Yield a row a for each plane, a . x <= 0, shape (count,)."""
        for span, torsion_m, directions in zip(self._spans, self._torsions_m, self._directions, strict=True):
            for direction in directions:
                row = np.zeros(self._count)
                row[span] = [-1.0, *(direction / self._axes(torsion_m))]
                yield row

    def contain(self, x: FloatArray) -> bool:
        """Return whether a solution is inside all limit surfaces; if not, add planes and renew patches."""
        inside = True
        for k, span in enumerate(self._spans):
            normal, *friction = x[span]
            real = self._pad.torsion_m(normal, self._friction)
            if abs(real - self._torsions_m[k]) > _TOLERANCE * real:
                self._torsions_m[k], inside = real, False
            scaled = np.array(friction) / self._axes(self._torsions_m[k])
            length = float(np.linalg.norm(scaled))
            if length > (1.0 + _TOLERANCE) * normal:
                self._directions[k].append(scaled / length)
                inside = False
        return inside

    def _axes(self, torsion_m: float) -> FloatArray:
        """Return the semi-axes of a pad's ellipsoid under 1 N, in the programme's unknowns."""
        return np.array([self._friction, self._friction, torsion_m / self._unit_m])
