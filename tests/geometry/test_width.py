"""The smallest width of solids whose width is known."""

import numpy as np
import pytest
import trimesh

from graspbench.geometry.width import smallest_width


def test_width_of_a_turned_box_is_its_shortest_edge():
    box = trimesh.creation.box((0.05, 0.02, 0.09))
    box.apply_transform(trimesh.transformations.random_rotation_matrix(np.array([0.2, 0.5, 0.8])))
    assert smallest_width(np.asarray(box.vertices)) == pytest.approx(0.02)


def test_width_of_a_ball_is_about_its_diameter():
    ball = trimesh.creation.icosphere(3, radius=0.03)
    assert smallest_width(np.asarray(ball.vertices)) == pytest.approx(0.06, rel=0.01)
