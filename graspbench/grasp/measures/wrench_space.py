"""Measures from the grasp wrench space, with bounded forces; 0 for a grasp that is not force closure."""

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from graspbench.arrays import BoolArray, FloatArray
from graspbench.grasp.epsilon import CLOSURE_TOLERANCE, smallest_support
from graspbench.grasp.measure import GraspBatch, measure
from graspbench.grasp.quality import ball_radius


@measure(
    "q3",
    definition="radius of the largest origin-centred ball in the grasp wrench space",
    value_range="[0, inf)",
    unit="1",
    source="Ferrari and Canny 1992; Q3 of the thesis",
)
def largest_ball(grasps: GraspBatch) -> FloatArray:
    """Return Q3 in the norm of the quality parameters, shape (n,)."""
    return ball_radius(grasps.maps, grasps.polytope, norm=grasps.quality.norm)


@measure(
    "hull_volume",
    definition="volume of the hull of all contacts' unit cone wrenches",
    value_range="[0, inf)",
    unit="1",
    source="Miller and Allen 1999; Roa and Suarez 2015",
)
def hull_volume(grasps: GraspBatch) -> FloatArray:
    """Return the volume, shape (n,)."""
    values = np.zeros(len(grasps.points))
    for k in np.flatnonzero(_closed(grasps)):
        values[k] = ConvexHull(_flat(grasps.wrenches[k])).volume
    return values


@measure(
    "min_weight",
    definition="least weight of a unit cone wrench in the most even convex combination that gives no wrench",
    value_range="[0, 1 / number of cone wrenches]",
    unit="1",
    source="Li and others 2023 (FRoGGeR), the min-weight metric",
)
def min_weight(grasps: GraspBatch) -> FloatArray:
    """Return the weight, shape (n,), by a linear program a grasp."""
    values = np.zeros(len(grasps.points))
    for k in np.flatnonzero(_closed(grasps)):
        corners = _flat(grasps.wrenches[k])
        count, size = corners.shape
        # weights are the least one plus something: sum(w (s + x)) = 0, count s + sum(x) = 1
        balance = np.column_stack([corners.T, corners.sum(axis=0)])
        total = np.append(np.ones(count), count)
        found = linprog(
            np.append(np.zeros(count), -1.0),
            A_eq=np.vstack([balance, total]),
            b_eq=np.append(np.zeros(size), 1.0),
            bounds=(0.0, None),
            method="highs",
        )
        values[k] = 0.0 if found.x is None else found.x[-1]
    return values


@measure(
    "task_ellipsoid",
    definition="largest factor by which the task ellipsoid fits into the hull of the unit cone wrenches; "
    "its semi-axes are 1 for forces, quality.task_moment for moments",
    value_range="[0, inf)",
    unit="1",
    source="Li and Sastry 1988; Roa and Suarez 2015",
)
def task_ellipsoid(grasps: GraspBatch) -> FloatArray:
    """Return the factor, shape (n,): the ball's radius where the ellipsoid is a unit ball."""
    axes = np.ones(grasps.maps.shape[-2])
    forces = {6: 3, 3: 2}.get(len(axes), len(axes))
    if grasps.quality.wrench_space in ("spatial", "planar"):
        axes[forces:] = grasps.quality.task_moment
    return ball_radius(grasps.maps / axes[:, None], grasps.polytope)


def _closed(grasps: GraspBatch) -> BoolArray:
    radii = smallest_support(grasps.wrenches, grasps.polytope, stop_at=CLOSURE_TOLERANCE)
    return np.asarray(radii > CLOSURE_TOLERANCE)


def _flat(wrenches: FloatArray) -> FloatArray:
    return wrenches.reshape(-1, wrenches.shape[-1])
