"""The camera follows a moving object, first from afar, then from its stations about the predicted centre."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ImageError
from graspbench.perception.camera import Intrinsics, View
from graspbench.perception.detection import enclosing_radius_m, wide_station
from graspbench.perception.following import CentreFollower
from graspbench.perception.segmentation import SilhouetteParameters, silhouettes
from graspbench.perception.silhouette import Silhouette
from graspbench.perception.stations import Station, StationParameters, fit_stations, place_stations

WIDE_SLANTS_DEG = ((0.0, 0.0), (45.0, 0.0), (45.0, 90.0), (45.0, 180.0), (45.0, 270.0), (0.0, 0.0))
"""Angle and azimuth of the wide views, one after the other."""

_STEPS_BACK = (1.0, 1.5)
_FIRST_HEIGHT_M = 0.03
_ROOM = 1.1
"""The ball about a centre that is only predicted is taken so much larger."""


class TrackedViews(NamedTuple):
    """What the camera saw of a moving object.

    Attributes:
        wide: Silhouettes of the wide views.
        wide_times_s: When these were taken, shape (n,).
        views: The stations' views, each with its time.
    """

    wide: tuple[Silhouette, ...]
    wide_times_s: FloatArray
    views: tuple[View, ...]


def track_object(
    take: Callable[[Station], View],
    entry: FloatArray,
    parameters: StationParameters,
    intrinsics: Intrinsics,
    blobs: SilhouetteParameters,
) -> TrackedViews:
    """Look at a moving object from afar, then from every station, led by a filter of its centre.

    Args:
        take: Moves the camera to a station and returns its image, with its time; time goes by meanwhile.
        entry: Where objects come from: the first wide view looks there, shape (3,).
        parameters: The stations.
        intrinsics: The camera's.
        blobs: How a blob is told from the background.

    Raises:
        ImageError: No object, or no single one, is in view.
        StationError: A station is outside the workspace, or there are too few.
    """
    view, silhouette = _seen(take, entry, WIDE_SLANTS_DEG[0], parameters, blobs)
    ray = silhouette.camera.rays(silhouette.centroid[None])[0]
    origin = silhouette.camera.position
    time_s = _time_of(view)
    follower = CentreFollower(origin + ray * ((_FIRST_HEIGHT_M - origin[2]) / ray[2]), time_s)
    follower.see(silhouette, time_s)
    wide, times, pace = [silhouette], [time_s], 0.0
    for slant in WIDE_SLANTS_DEG[1:]:
        view, silhouette = _seen(take, follower.predicted(time_s + pace), slant, parameters, blobs)
        pace, time_s = _time_of(view) - time_s, _time_of(view)
        follower.see(silhouette, time_s)
        wide.append(silhouette)
        times.append(time_s)
    # What a view from afar showed around the centre as it is known by now.
    back = [follower.predicted(t) for t in times[-4:]]
    radius_m = _ROOM * max(enclosing_radius_m(s, c) for s, c in zip(wide[-4:], back, strict=True))
    fitted = fit_stations(parameters, intrinsics, radius_m)
    views: list[View] = []
    for number in range(len(place_stations(follower.predicted(time_s + pace), fitted))):
        station = place_stations(follower.predicted(time_s + pace), fitted)[number]
        view = take(station)
        time_s = _time_of(view)
        follower.see(silhouettes([view], blobs)[0], time_s)
        views.append(view)
    return TrackedViews(tuple(wide), np.array(times), tuple(views))


def _seen(
    take: Callable[[Station], View],
    target: FloatArray,
    slant: tuple[float, float],
    parameters: StationParameters,
    blobs: SilhouetteParameters,
) -> tuple[View, Silhouette]:
    """Return a wide view and its silhouette; from farther off where the object does not fit into it."""
    first: ImageError | None = None
    for factor in _STEPS_BACK:
        view = take(wide_station(0, target, slant, factor * parameters.home_distance_m))
        try:
            return view, silhouettes([view], blobs)[0]
        except ImageError as error:
            first = first or error
    assert first is not None
    raise ImageError(
        f"the camera loses the moving object: {first.what}",
        remedy="put one object in view (scene.x_m, scene.y_m), or raise stations.home_distance_m",
        **first.data,
    ) from first


def _time_of(view: View) -> float:
    assert view.time_s is not None, "views of a moving scene have their times"
    return view.time_s
