"""Cameras, stations, silhouettes, and the object's centre seen from several views."""

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
