"""A climb that cannot begin leaves the planned grasp as it is."""

from types import SimpleNamespace

import numpy as np

from graspbench.config.trial_config import load_config
from graspbench.grasp.configuration import Grasp
from graspbench.trial.strengthening import _climbed
from tests.planning.shapes import ellipsoid


def test_a_grasp_that_the_climb_cannot_begin_at_is_executed_as_planned():
    surface = ellipsoid((0.03, 0.03, 0.03))
    one_sided = np.array([0, 1, 2])  # no force closure
    grasp = Grasp(one_sided, surface.points[one_sided], surface.normals[one_sided], surface.centroid, None)
    trial = SimpleNamespace(surfaces=[surface])
    assert _climbed(load_config(), trial, grasp, None) is grasp
