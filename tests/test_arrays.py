"""The small replacements of slow general routines give what those give."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from graspbench.arrays import cross, rotation_matrix


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 1.001e-3, 0.1, 1.0, 6.0])
def test_a_rotation_vector_gives_scipys_matrix(size):
    for vector in size * np.random.default_rng(0).normal(size=(50, 3)):
        np.testing.assert_allclose(
            rotation_matrix(vector), Rotation.from_rotvec(vector).as_matrix(), rtol=0, atol=4e-16
        )


def test_cross_is_numpys():
    a, b = np.random.default_rng(0).normal(size=(2, 7, 5, 3))
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))
    np.testing.assert_array_equal(cross(a[0, 0], b), np.cross(a[0, 0], b))
