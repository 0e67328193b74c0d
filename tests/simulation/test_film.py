"""The film of an execution shows the hand and the object move, in a file that a browser plays."""

import cv2
import numpy as np
import pytest
from PIL import Image

from graspbench.config.trial_config import load_config
from graspbench.geometry import load_object
from graspbench.hand import load_hand
from graspbench.simulation import film
from graspbench.simulation.execution_result import Motion


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    config = load_config(["object=cube"])
    hand, n = load_hand(config.hand), 51
    palm, thing = np.tile(np.eye(4), (n, 1, 1)), np.tile(np.eye(4), (n, 1, 1))
    palm[:, :3, :3] = np.diag([1.0, -1.0, -1.0])  # it looks down
    rise = np.linspace(0.0, 0.2, n)
    palm[:, 2, 3], thing[:, 2, 3] = 0.2 + rise, rise
    joints = np.tile(0.5 * (hand.lower + hand.upper), (n, 1))
    motion = Motion(np.linspace(0.0, 1.0, n), joints, palm, thing)
    return load_object(config.object), config.scene, hand, motion


def frames(path):
    reader = cv2.VideoCapture(str(path))
    found = []
    while True:
        more, frame = reader.read()
        if not more:
            return np.array(found)
        found.append(frame[..., ::-1])


def red_height(frame, colour):
    near = np.abs(frame.astype(int) - colour).sum(axis=-1) < 120
    return np.argwhere(near)[:, 0].mean()


def test_a_film_shows_the_object_rise_with_the_hand(made, tmp_path):
    path = film.film_execution(tmp_path, *made)
    shown = frames(path)
    assert path.name == "execution.mp4"
    assert shown.shape == (11, 300, 400, 3)  # 1 s at 10 a second, and the first
    colour = 255 * np.array(made[0].rgba[:3])
    assert red_height(shown[-1], colour) < red_height(shown[0], colour) - 30  # upwards
    assert path.stat().st_size < 400_000


def test_a_long_execution_makes_no_longer_film(made):
    shown, _ = film._frames(np.linspace(0.0, 60.0, 3001))
    assert len(shown) == film._MAX_FRAMES
    assert (shown[0], shown[-1]) == (0, 3000)


def test_without_an_encoder_it_is_a_gif(made, tmp_path, monkeypatch):
    monkeypatch.setattr(film, "_CODECS", (("nope", ".mp4"),))
    monkeypatch.setattr(film, "_MAX_FRAMES", 3)
    path = film.film_execution(tmp_path, *made)
    assert [each.name for each in tmp_path.iterdir()] == ["execution.gif"]
    with Image.open(path) as opened:
        assert opened.n_frames == 3
