"""One place says which holes a reconstruction method carries."""

import numpy as np
import pytest

from graspbench.perception import Camera, CameraParameters, look_at
from graspbench.perception.silhouette import silhouette_of_mask
from graspbench.reconstruction.genus import carried_by, max_genus, method_for
from graspbench.reconstruction.methods import METHODS


def seen(*, hole):
    camera = Camera(CameraParameters().intrinsics, look_at(np.array([0.0, 0.0, 0.5]), np.zeros(3)))
    rows, columns = np.mgrid[: camera.intrinsics.height, : camera.intrinsics.width]
    far = np.hypot(rows - 240, columns - 320)
    return silhouette_of_mask("top", (far < 100) & (far >= 30 if hole else True), camera)


@pytest.mark.parametrize("method", [*METHODS.names(), "of_a_plug_in"])
def test_a_method_takes_silhouettes_with_the_holes_that_it_carries(method):
    (taken,) = carried_by(method, [seen(hole=True)])
    assert taken.holes == (0 if max_genus(method) == 0 else 1)


def test_the_thesis_surface_is_taken_where_no_hole_is_seen():
    assert max_genus(method_for([seen(hole=False)])) == 0
    assert max_genus(method_for([seen(hole=False), seen(hole=True)])) is None
