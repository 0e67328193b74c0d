"""Inertia tensors before and after they are mended."""

from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from graspbench.simulation.inertia import mend_inertias, possible_inertia


@pytest.mark.parametrize("moments", [(1.0, 2.0, 4.0), (0.0, 1.0, 1.0), (-1.0, 3.0, 3.5), (0.1, 0.2, 9.0)])
def test_impossible_tensor_becomes_possible_and_keeps_axes_and_largest_moment(moments):
    turn = Rotation.from_euler("xyz", [0.3, -0.7, 1.1]).as_matrix()
    mended = possible_inertia(turn @ np.diag(moments) @ turn.T)
    found = np.diag(turn.T @ mended @ turn)
    np.testing.assert_allclose(turn.T @ mended @ turn, np.diag(found), atol=1e-12)
    assert found[2] == pytest.approx(moments[2])
    assert np.all(found > 0.0)
    assert found[0] + found[1] > found[2]
    assert np.all(found >= np.array(moments) - 1e-12)


def test_possible_tensor_stays_as_it_is():
    tensor = np.diag([1.0, 1.5, 2.0])
    assert possible_inertia(tensor) is tensor


def test_urdf_is_changed_where_it_has_to_be():
    robot = ElementTree.fromstring(
        "<robot><link><inertial><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>"
        "<link><inertial><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='3'/></inertial></link></robot>"
    )
    mend_inertias(robot)
    good, bad = robot.iter("inertia")
    assert good.get("ixx") == "1"
    assert float(bad.get("izz")) == pytest.approx(3.0)
    assert float(bad.get("ixx")) + float(bad.get("iyy")) > 3.0
