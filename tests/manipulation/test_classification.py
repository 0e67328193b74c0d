import numpy as np
import pytest

from graspbench.manipulation.classification import classify
from tests.manipulation.boxes import OPPOSITE, TRIPOD, box_hand


def test_two_opposite_hard_fingers_leave_the_rotation_about_their_line():
    grasp = classify(box_hand(*OPPOSITE, "hard"))
    assert grasp.indeterminate
    assert len(grasp.object_motions) == 1
    linear, angular = grasp.object_motions[0][:3], grasp.object_motions[0][3:]
    line = np.array([1.0, 0.0, 0.0])
    assert abs(angular @ line) == pytest.approx(np.linalg.norm(angular))
    # every point of the line of contacts stays where it is
    np.testing.assert_allclose(linear + np.cross(angular, [0.0, 0.01, 0.0]), 0.0, atol=1e-12)


def test_three_hard_fingers_not_in_line_are_determinate():
    grasp = classify(box_hand(*TRIPOD, "hard"))
    assert not grasp.indeterminate
    assert grasp.object_motions.shape == (0, 6)


def test_two_soft_fingers_are_determinate():
    assert not classify(box_hand(*OPPOSITE, "soft")).indeterminate


def test_three_hard_fingers_in_line_are_indeterminate():
    points = [[0.05, 0.0, 0.0], [-0.05, 0.0, 0.0], [0.02, 0.0, 0.0]]
    normals = [[1.0, 0, 0], [-1.0, 0, 0], [0, 0, 1.0]]
    assert classify(box_hand(points, normals, "hard")).indeterminate


def test_frictionless_box_slides_between_its_fingers():
    grasp = classify(box_hand(*OPPOSITE, "frictionless"))
    # on two parallel faces: translations in the faces' plane, and all rotations about x
    assert grasp.indeterminate
    spans = np.linalg.matrix_rank(grasp.object_motions, tol=1e-9)
    assert spans == len(grasp.object_motions) >= 3


def test_object_and_contact_motions_satisfy_the_contact_equations():
    state = box_hand(*OPPOSITE, "hard")
    grasp = classify(state)
    transposes = np.vstack([state.grasp_transpose(i) for i in range(2)])
    for twist, rates in zip(grasp.object_motions, grasp.contact_motions, strict=True):
        np.testing.assert_allclose(state.jacobian @ rates, transposes @ twist, atol=1e-12)


def test_redundancy_is_that_of_the_extended_fingers():
    three = classify(box_hand(*TRIPOD, "hard", joints=3))
    assert not three.redundant
    assert three.redundant_fingers == (False, False, False)
    four = classify(box_hand(*TRIPOD, "hard", joints=4))
    assert four.redundant
    assert four.redundant_fingers == (True, True, True)
    assert four.internal_motions.shape == (3, 3 * 4 + 9)
    state = box_hand(*TRIPOD, "hard", joints=4)
    np.testing.assert_allclose(state.jacobian @ classify(state).internal_motions.T, 0.0, atol=1e-10)


def test_mobility_counts():
    grasp = classify(box_hand(*TRIPOD, "hard", joints=3))
    # 9 joints + 9 angles; three extended fingers of 6 variables each drive one object of 6
    assert (grasp.variables, grasp.closed_chain_constraints, grasp.degrees_of_freedom) == (18, 12, 6)
    assert grasp.controllable
