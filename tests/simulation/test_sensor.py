from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

from graspbench.simulation.scene import SceneParameters
from graspbench.simulation.sensor import expose

PLAIN = SceneParameters(noise_std=0.0, light_gradient=0.0)
GREY = np.full((200, 300, 3), 100, np.uint8)


def shot(scene, seed=0, image=GREY):
    return expose(image, scene, np.random.default_rng(seed))


def test_a_perfect_sensor_changes_nothing():
    np.testing.assert_array_equal(shot(PLAIN), GREY)


@pytest.mark.parametrize("std", [1.5, 6.0, 20.0])
def test_noise_is_normal_with_the_given_deviation(std):
    noise = shot(replace(PLAIN, noise_std=std)).astype(float) - 100.0
    assert noise.mean() == pytest.approx(0.0, abs=0.03 * std)
    assert noise.std() == pytest.approx(np.hypot(std, 1 / np.sqrt(12)), rel=0.02)
    whole = (np.ceil(std) - 0.5) / std
    assert np.mean(np.abs(noise) < std) == pytest.approx(ndtr(whole) - ndtr(-whole), abs=0.01)
    channels = np.corrcoef(noise.reshape(-1, 3).T)
    assert abs(channels[0, 1]) < 0.02


def test_noise_saturates():
    white = np.full((50, 50, 3), 254, np.uint8)
    assert shot(replace(PLAIN, noise_std=10.0), image=white).max() == 255


def test_the_given_fraction_of_pixels_is_stuck():
    image = shot(replace(PLAIN, salt_pepper=0.04))
    assert np.mean(np.all(image == 0, axis=2)) == pytest.approx(0.02, abs=0.003)
    assert np.mean(np.all(image == 255, axis=2)) == pytest.approx(0.02, abs=0.003)


@pytest.mark.parametrize(("direction", "axis"), [(0.0, 1), (90.0, 0)])
def test_the_gradient_spans_the_given_fraction_across_the_image(direction, axis):
    image = shot(replace(PLAIN, light_gradient=0.4, light_gradient_deg=direction))
    profile = image[..., 0].mean(axis=1 - axis)
    assert profile[0] == pytest.approx(80.0, abs=1.0)
    assert profile[-1] == pytest.approx(120.0, abs=1.0)
    assert np.ptp(image[..., 0].mean(axis=axis)) == 0.0


def test_blur_keeps_the_mean_and_softens_edges():
    image = GREY.copy()
    image[:, 150:] = 200
    soft = shot(replace(PLAIN, blur_px=2.0), image=image)[100, :, 0].astype(float)
    assert soft.mean() == pytest.approx(150.0, abs=0.5)
    assert np.abs(np.diff(soft)).max() < 25.0


def test_the_generator_decides():
    noisy = replace(PLAIN, noise_std=5.0)
    np.testing.assert_array_equal(shot(noisy, 3), shot(noisy, 3))
    assert np.any(shot(noisy, 3) != shot(noisy, 4))
