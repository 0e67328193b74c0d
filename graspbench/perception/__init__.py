"""Cameras, stations, silhouettes, and the object's centre seen from several views."""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use

if TYPE_CHECKING:
    from graspbench.perception.camera import Camera, CameraParameters, Intrinsics, View, look_at
    from graspbench.perception.segmentation import SilhouetteParameters, silhouettes
    from graspbench.perception.silhouette import Silhouette
    from graspbench.perception.stations import Ring, Station, StationParameters, place_stations
    from graspbench.perception.triangulation import triangulate_centre

__all__ = [
    "Camera",
    "CameraParameters",
    "Intrinsics",
    "Ring",
    "Silhouette",
    "SilhouetteParameters",
    "Station",
    "StationParameters",
    "View",
    "look_at",
    "place_stations",
    "silhouettes",
    "triangulate_centre",
]

_HOMES = {
    "Camera": "camera",
    "CameraParameters": "camera",
    "Intrinsics": "camera",
    "Ring": "stations",
    "Silhouette": "silhouette",
    "SilhouetteParameters": "segmentation",
    "Station": "stations",
    "StationParameters": "stations",
    "View": "camera",
    "look_at": "camera",
    "place_stations": "stations",
    "silhouettes": "segmentation",
    "triangulate_centre": "triangulation",
}

__getattr__ = loads_on_use(__name__, _HOMES)
