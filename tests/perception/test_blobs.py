import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from graspbench.perception.blobs import clean, disc, fill_holes, hole_count, largest_blob


def random_mask(seed, share):
    return np.random.default_rng(seed).random((40, 50)) < share


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 999), share=st.floats(0.2, 0.8))
def test_the_largest_blob_is_that_of_an_independent_labelling(seed, share):
    mask = random_mask(seed, share)
    labels, _ = ndimage.label(mask)
    sizes = np.bincount(labels.ravel())[1:]
    blob = largest_blob(mask.astype(np.uint8))
    assert blob.sum() == sizes.max()
    assert len(np.unique(labels[blob])) == 1


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 999), share=st.floats(0.3, 0.8))
def test_holes_are_those_of_an_independent_filling(seed, share):
    mask = random_mask(seed, share)
    filled = ndimage.binary_fill_holes(mask)
    np.testing.assert_array_equal(fill_holes(mask), filled)
    assert hole_count(mask) == ndimage.label(filled & ~mask)[1]


def test_an_empty_mask_has_no_blob():
    assert largest_blob(np.zeros((10, 10), np.uint8)) is None


@pytest.mark.parametrize(("erosion", "dilation"), [(0, 0), (1, 0), (0, 2), (2, 3)])
def test_cleaning_is_an_opening_and_a_closing(erosion, dilation):
    mask = np.pad(random_mask(5, 0.6), 10)
    expected = mask
    if erosion:
        expected = ndimage.binary_opening(expected, disc(erosion))
    if dilation:
        expected = ndimage.binary_closing(expected, disc(dilation))
    np.testing.assert_array_equal(clean(mask.astype(np.uint8), erosion, dilation), expected)
