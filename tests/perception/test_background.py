import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from graspbench.perception.background import Background, learn_background
from tests.perception.drawing import TABLE


def brute_distance(colour, modes):
    fractions = np.linspace(0.0, 1.0, 20001)[:, None]
    best = np.inf
    for *mode, low, high in modes:
        segment = (low + fractions * (high - low)) * np.array(mode)
        best = min(best, np.linalg.norm(segment - colour, axis=1).min())
    return best


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_the_distance_is_that_to_the_nearest_brightness_segment(seed):
    generator = np.random.default_rng(seed)
    modes = np.column_stack(
        (generator.uniform(5, 255, (3, 3)), generator.uniform(0.2, 0.9, 3), generator.uniform(1, 1.4, 3))
    ).astype(np.float32)
    colour = generator.integers(0, 256, (1, 1, 3), dtype=np.uint8)
    found = Background(modes, 0.0, np.zeros(3)).distance(colour)[0, 0]
    assert abs(found - brute_distance(colour[0, 0], modes.astype(float))) < 0.05


def test_the_modes_are_the_borders_colours():
    image = np.tile(TABLE, (120, 160, 1))
    image[:40] = (140.0, 140.0, 130.0)
    image[40:80, 60:100] = (200.0, 20.0, 20.0)
    background = learn_background([image.astype(np.uint8)], 0.4, 0.08)
    assert len(background.modes) == 2
    for colour in (TABLE, (140.0, 140.0, 130.0)):
        assert np.linalg.norm(background.modes[:, :3] - colour, axis=1).min() < 1.0
    distance = background.distance(image.astype(np.uint8))
    assert distance[60, 80] > 100.0
    assert distance[:40].max() < 1.0


def test_shadow_is_background_down_to_the_darkest_allowed():
    image = np.tile(TABLE, (120, 160, 1)).astype(np.uint8)
    background = learn_background([image], 0.4, 0.08)
    shades = np.array([[0.45 * TABLE, 0.2 * TABLE]]).astype(np.uint8)
    inside, beyond = background.distance(shades)[0]
    assert inside < 1.5
    assert beyond > 20.0
