"""Foxglove messages against the protobuf library's own encoding and scipy's quaternions."""

import numpy as np
import pytest
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from graspbench.perception.camera import Camera, Intrinsics
from graspbench.record import messages


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-9, np.pi / 2, np.pi - 1e-9, np.pi]))
def test_quaternion_is_scipys_up_to_sign(seed, angle):
    axis = np.random.default_rng(seed).normal(size=3)
    rotation = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))

    q = messages.quaternion(rotation.as_matrix())

    ours = np.array([q.x, q.y, q.z, q.w])
    assert abs(ours @ rotation.as_quat()) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("count", [1, 40, 5000])
def test_packed_triangles_read_back_as_written(count):
    generator = np.random.default_rng(count)
    points = generator.normal(size=(count, 3))
    faces = generator.integers(0, count, size=(2 * count, 3))

    wire = messages.triangles(points, faces, (0.1, 0.2, 0.3, 1.0)).SerializeToString()
    read = TriangleListPrimitive.FromString(wire)

    np.testing.assert_allclose([(p.x, p.y, p.z) for p in read.points], points, rtol=1e-7)
    np.testing.assert_array_equal(np.reshape(read.indices, (-1, 3)), faces)
    assert read.color.b == 0.3


def test_arrow_points_along_its_direction():
    direction = np.array([2.0, -1.0, 0.5]) / np.linalg.norm([2.0, -1.0, 0.5])
    q = messages.arrow(np.zeros(3), direction, 0.1, (1, 0, 0, 1)).pose.orientation
    np.testing.assert_allclose(
        Rotation.from_quat([q.x, q.y, q.z, q.w]).apply([1, 0, 0]), direction, atol=1e-12
    )


def test_arrow_of_length_is_as_long_as_asked():
    arrow = messages.arrow(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.25, (1, 0, 0, 1))
    assert arrow.shaft_length + arrow.head_length == pytest.approx(0.25)


def test_calibration_counts_from_the_first_pixels_centre():
    camera = Camera(Intrinsics(640, 480, 600.0, 601.0, 320.0, 240.0), np.eye(4))
    calibration = messages.camera_calibration(0, camera)
    assert list(calibration.K) == [600.0, 0, 319.5, 0, 601.0, 239.5, 0, 0, 1]


def test_time_stamp_keeps_nanoseconds():
    stamp = messages.timestamp(3_000_000_007)
    assert (stamp.seconds, stamp.nanos) == (3, 7)
