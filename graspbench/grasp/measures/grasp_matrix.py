"""Measures from the singular values of the grasp matrix."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.measure import GraspBatch, measure
from graspbench.grasp.quality import singular_measures
from graspbench.grasp.wrench import grasp_matrix


@measure(
    "q1",
    definition="smallest singular value of the grasp matrix",
    value_range="[0, inf)",
    unit="1",
    source="Li and Sastry 1988; Q1 of the thesis",
)
def smallest_singular_value(grasps: GraspBatch) -> FloatArray:
    """Return Q1, shape (n,)."""
    return singular_measures(grasp_matrix(grasps.maps))[0]


@measure(
    "q2",
    definition="product of the grasp matrix's singular values",
    value_range="[0, inf)",
    unit="1",
    source="Li and Sastry 1988; Q2 of the thesis",
)
def ellipsoid_volume(grasps: GraspBatch) -> FloatArray:
    """Return Q2, shape (n,)."""
    return singular_measures(grasp_matrix(grasps.maps))[1]


@measure(
    "isotropy",
    definition="smallest over largest singular value of the grasp matrix",
    value_range="[0, 1]",
    unit="1",
    source="Kim, Oh, Yi and Suh 2001; Roa and Suarez 2015",
)
def isotropy(grasps: GraspBatch) -> FloatArray:
    """Return the grasp isotropy index, shape (n,)."""
    matrices = grasp_matrix(grasps.maps)
    largest = np.linalg.svd(matrices, compute_uv=False)[..., 0]
    return np.asarray(singular_measures(matrices)[0] / np.maximum(largest, 1e-300))
