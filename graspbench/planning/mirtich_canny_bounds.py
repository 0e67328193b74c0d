"""What the thresholds of Mirtich and Canny's index imply before any triple is looked at."""

import numpy as np

from graspbench.reconstruction.surface import Surface

_GRID = 61


def cosine_range(phi_cei_deg: float, phi_eegi_deg: float) -> tuple[float, float]:
    """Return the least and the largest cosine between two normals of a grasp within the thresholds.

    The normals' tilts a, b out of the grip plane sum to at most 3 CEI. The three angles phi between their
    projections sum to 360 degrees when they surround a point, so one deviates from 120 degrees by at most
    half of their summed deviation, 1.5 EEGI. Their cosine is sin a sin b + cos a cos b cos phi.

    Args:
        phi_cei_deg: Largest coplanarity error.
        phi_eegi_deg: Largest equilateral error.
    """
    if 3.0 * phi_cei_deg >= 90.0:
        return -1.0, 1.0
    most, spread = np.deg2rad(3.0 * phi_cei_deg), np.deg2rad(min(1.5 * phi_eegi_deg, 60.0))
    # For fixed phi the only extremes inside |a| + |b| <= most are saddles.
    a = np.linspace(0.0, most, _GRID)
    b = most - a
    cosines = [
        sign * np.sin(a) * np.sin(b) + np.cos(a) * np.cos(b) * np.cos(2.0 * np.pi / 3.0 + turn)
        for sign in (1.0, -1.0)
        for turn in (-spread, spread)
    ]
    # Between grid points the extremes may be a little further out.
    slack = (most / (_GRID - 1)) ** 2
    return float(np.min(cosines)) - slack, float(np.max(cosines)) + slack


def largest_possible_m2(surface: Surface, phi_eegi_deg: float) -> float:
    """Return an area that no outer triangle of the surface exceeds, looking at none.

    The three lines are at most a radius from the centroid; the triangle around a circle of that radius, with
    angles phi_j between its normals, has the area r^2 sum tan(phi_j / 2). The sum is convex, so its largest
    value is where one angle is 1.5 EEGI above 120 degrees and another one as much below.
    """
    half = 0.75 * phi_eegi_deg
    if half >= 30.0:
        return np.inf
    radius = float(np.linalg.norm(surface.points - surface.centroid, axis=1).max())
    return radius**2 * float(np.sum(np.tan(np.deg2rad([60.0 - half, 60.0, 60.0 + half])))) * (1.0 + 1e-9)
