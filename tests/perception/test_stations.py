from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspbench.errors import StationError
from graspbench.perception import Camera, CameraParameters, Ring, StationParameters, place_stations
from graspbench.perception.stations import fit_stations

CENTRE = np.array([0.03, -0.05, 0.07])
THESIS = StationParameters()


def test_the_thesis_set_is_a_top_view_and_two_rings():
    names = [station.name for station in place_stations(CENTRE, THESIS)]
    assert names == ["top", *(f"outer-{i}" for i in range(8)), *(f"inner-{i}" for i in range(4))]


@given(
    count=st.integers(3, 12),
    radius=st.floats(0.2, 0.6),
    angle=st.floats(20.0, 85.0),
    phase=st.floats(-180, 180),
)
def test_ring_stations_have_their_radius_and_angle_and_meet_the_centre(count, radius, angle, phase):
    ring = Ring(count, radius, angle, phase)
    parameters = replace(THESIS, top=False, outer=ring, inner=Ring(), workspace_height_m=(0.0, 5.0))
    stations = place_stations(CENTRE, parameters)
    poses = np.array([s.transform_camera_to_world for s in stations])
    offset = poses[:, :3, 3] - CENTRE
    np.testing.assert_allclose(np.hypot(offset[:, 0], offset[:, 1]), radius)
    np.testing.assert_allclose(np.degrees(np.arccos(-poses[:, 2, 2])), angle, atol=1e-6)
    steps = np.diff(np.unwrap(np.arctan2(offset[:, 1], offset[:, 0])))
    np.testing.assert_allclose(steps, 2 * np.pi / count, atol=1e-9)
    for pose in poses:
        seen = Camera(CameraParameters().intrinsics, pose).project(CENTRE[None])[0]
        np.testing.assert_allclose(seen, (320, 240), atol=1e-6)


@pytest.mark.parametrize(
    ("change", "names"),
    [
        ({"top": False}, 12),
        ({"outer": Ring(0)}, 5),
        ({"inner": Ring(0)}, 9),
        ({"top": False, "inner": Ring(0)}, 8),
    ],
)
def test_subsets_can_be_switched_off(change, names):
    assert len(place_stations(CENTRE, replace(THESIS, **change))) == names


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"outer": Ring(8, 0.0, 65.0)}, "outer ring's radius is 0 m"),
        ({"inner": Ring(4, -0.1, 65.0)}, "inner ring's radius is -0.1 m"),
        ({"outer": Ring(8, 0.4, 90.0)}, "90 deg with the vertical"),
        ({"outer": Ring(8, 0.4, 120.0)}, "120 deg with the vertical"),
        ({"inner": Ring(4, 0.4, 0.0)}, "0 deg with the vertical"),
        ({"outer": Ring(0), "inner": Ring(0)}, "1 camera stations are too few"),
        ({"top": False, "outer": Ring(2), "inner": Ring(0)}, "2 camera stations are too few"),
        ({"outer": Ring(8, 1.6, 65.0)}, "workspace ends at 1.5 m"),
        ({"top_distance_m": 2.0}, "station top is 2.070 m above the table"),
    ],
)
def test_degenerate_stations_are_one_clear_sentence(change, message):
    with pytest.raises(StationError, match=message) as raised:
        place_stations(CENTRE, replace(THESIS, **change))
    assert str(raised.value).count("\n") == 0
    assert raised.value.exit_code == 2


def test_a_station_below_the_table_is_refused():
    with pytest.raises(StationError, match="above the table"):
        place_stations(np.array([0.0, 0.0, -0.3]), THESIS)


@given(
    radius=st.floats(0.03, 0.2),
    fill=st.floats(0.2, 0.85),
    cx=st.one_of(st.none(), st.floats(280.0, 360.0)),
)
def test_fitted_stations_show_a_ball_as_large_as_asked(radius, fill, cx):
    camera = CameraParameters(cx=cx)
    wide = replace(THESIS, fill=fill, workspace_height_m=(0.0, 9.0), workspace_radius_m=9.0, nearest_m=0.01)
    stations = place_stations(CENTRE, fit_stations(wide, camera.intrinsics, radius))
    shares = []
    for station in stations:
        pose = station.transform_camera_to_world
        distance = np.linalg.norm(pose[:3, 3] - CENTRE)
        limb = np.tan(np.arcsin(radius / distance))
        k = camera.intrinsics
        shares.append(limb / min(min(k.cx, k.width - k.cx) / k.fx, min(k.cy, k.height - k.cy) / k.fy))
    assert max(shares) == pytest.approx(fill)
    assert min(shares) > 0.9 * fill
    for before, after in zip(place_stations(CENTRE, THESIS), stations, strict=True):
        a, b = (s.transform_camera_to_world[:3, :3] for s in (before, after))
        np.testing.assert_allclose(a, b, atol=1e-12)


def test_a_tiny_object_is_not_approached_nearer_than_the_lens_allows():
    fitted = fit_stations(THESIS, CameraParameters().intrinsics, 0.005)
    gaps = [s.transform_camera_to_world[:3, 3] - CENTRE for s in place_stations(CENTRE, fitted)]
    assert np.linalg.norm(gaps, axis=1).min() == pytest.approx(THESIS.nearest_m)


def test_without_fit_the_radii_stay():
    fixed = replace(THESIS, fit=False)
    assert fit_stations(fixed, CameraParameters().intrinsics, 0.02) is fixed


def test_an_object_too_large_for_the_workspace_is_named():
    fitted = fit_stations(THESIS, CameraParameters().intrinsics, 0.5)
    with pytest.raises(StationError, match="workspace"):
        place_stations(CENTRE, fitted)
