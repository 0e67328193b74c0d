"""Measures from the positions of the contacts alone."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.measure import GraspBatch, measure
from graspbench.grasp.wrench import grasp_plane_normal, wrench_projection


@measure(
    "polygon_area",
    definition="area of the polygon of the contacts in the grasp plane",
    value_range="[0, inf)",
    unit="m^2",
    source="Mirtich and Canny 1994; Roa and Suarez 2015",
)
def polygon_area(grasps: GraspBatch) -> FloatArray:
    """Return the area, shape (n,); 0 for two contacts."""
    corners = _polygons(grasps)
    after = np.roll(corners, -1, axis=1)
    doubled = corners[..., 0] * after[..., 1] - corners[..., 1] * after[..., 0]
    return np.asarray(0.5 * np.abs(doubled.sum(axis=1)))


@measure(
    "polygon_irregularity",
    definition="internal angles' total deviation from a regular polygon's, over the largest possible one",
    value_range="[0, 1]",
    unit="1",
    better="smaller",
    source="Kim, Oh, Yi and Suh 2001; Roa and Suarez 2015",
)
def polygon_irregularity(grasps: GraspBatch) -> FloatArray:
    """Return the deviation, shape (n,); 1 for two contacts, which are no polygon."""
    corners = _polygons(grasps)
    count = corners.shape[1]
    if count < 3:
        return np.ones(len(corners))
    back, ahead = np.roll(corners, 1, axis=1) - corners, np.roll(corners, -1, axis=1) - corners
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    angles = np.arctan2(cross, np.sum(ahead * back, axis=-1)) % (2.0 * np.pi)
    regular = np.pi * (count - 2) / count
    worst = (count - 2) * (np.pi - regular) + 2.0 * regular  # all corners on a line
    return np.asarray(np.abs(angles - regular).sum(axis=1) / worst)


@measure(
    "centre_distance",
    definition="distance from the mean of the contact points to the object's centroid",
    value_range="[0, inf)",
    unit="m",
    better="smaller",
    source="Ponce and others 1997; Roa and Suarez 2015",
)
def centre_distance(grasps: GraspBatch) -> FloatArray:
    """Return the distance, shape (n,)."""
    return np.asarray(np.linalg.norm(grasps.points.mean(axis=1) - grasps.centre, axis=-1))


def _polygons(grasps: GraspBatch) -> FloatArray:
    """Return the contacts in the grasp plane, anticlockwise round their mean, shape (n, n_f, 2)."""
    plane = grasp_plane_normal(grasps.points, grasps.normals_in)
    axes = wrench_projection("planar_force", plane)[..., :3]
    offsets = grasps.points - grasps.points.mean(axis=1, keepdims=True)
    flat = offsets @ np.swapaxes(axes, -1, -2)
    order = np.argsort(np.arctan2(flat[..., 1], flat[..., 0]), axis=1, kind="stable")
    return np.asarray(np.take_along_axis(flat, order[..., None], axis=1))
