import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspbench.perception.coverage import estimate_coverage
from tests.perception.drawing import paint


def half_plane(angle, offset, size=60, subdivisions=8):
    n = subdivisions
    x = (np.arange(size * n) + 0.5) / n - size / 2
    inside = np.cos(angle) * x + np.sin(angle) * x[:, None] < offset
    return inside.reshape(size, n, size, n).mean(axis=(1, 3))


@settings(max_examples=30, deadline=None)
@given(angle=st.floats(0, 2 * np.pi), offset=st.floats(-2, 2), cut=st.floats(0.1, 0.9))
def test_the_coverage_along_an_edge_is_found_from_any_rough_blob(angle, offset, cut):
    coverage = half_plane(angle, offset)
    estimate = estimate_coverage(paint(coverage), coverage > cut)
    assert np.abs(estimate - coverage).max() < 0.16
    assert np.abs((estimate - coverage).mean()) < 2e-3


def test_uniform_zones_are_exact():
    blob = np.zeros((40, 40), bool)
    blob[10:30, 10:30] = True
    estimate = estimate_coverage(paint(blob * 1.0), blob)
    np.testing.assert_array_equal(estimate, blob)


def test_thin_parts_fall_back_on_the_blob():
    blob = np.zeros((40, 40), bool)
    blob[20, 5:35] = True
    np.testing.assert_array_equal(estimate_coverage(paint(blob * 1.0), blob), blob)


def test_a_gradient_of_the_light_shifts_no_edge():
    coverage = half_plane(0.3, 0.7)
    image = paint(coverage) * np.linspace(0.7, 1.2, 60)[:, None, None]
    estimate = estimate_coverage(image.astype(np.uint8), coverage > 0.5)
    assert estimate.sum() == pytest.approx(coverage.sum(), rel=2e-3)
