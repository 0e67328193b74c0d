"""The stations from which the camera looks at the object (thesis 3.2.1)."""

from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import StationError
from graspbench.perception.camera import Intrinsics, look_at

MINIMUM_VIEWS = 3


@dataclass(frozen=True)
class Ring:
    """Stations evenly spread on a horizontal circle above the object."""

    count: Annotated[int, Field(ge=0, le=200, description="Number of stations; 0 switches the ring off")] = 0
    radius_m: Annotated[float, Field(description="Radius of the circle, m")] = 0.45
    angle_deg: Annotated[float, Field(description="Angle of the optical axes with the vertical, deg")] = 65.0
    phase_deg: Annotated[float, Field(description="Azimuth of the first station, deg")] = 0.0


@dataclass(frozen=True)
class StationParameters:
    """Top view, two rings, the detection pass before them, and the workspace they must stay in."""

    top: Annotated[bool, Field(description="Whether there is a top view")] = True
    top_distance_m: Annotated[
        float, Field(gt=0, description="Distance of the top view from the centre, m")
    ] = 0.5
    outer: Annotated[Ring, Field(description="The ring nearer to the horizon")] = field(
        default_factory=lambda: Ring(8, 0.45, 65.0)
    )
    inner: Annotated[Ring, Field(description="The ring nearer to the vertical")] = field(
        default_factory=lambda: Ring(4, 0.28, 35.0, 22.5)
    )
    fit: Annotated[
        bool, Field(description="Scale the stations' distances so that the object fills `fill` of the image")
    ] = True
    fill: Annotated[
        float,
        Field(
            gt=0, le=0.85, description="Share of the image's shorter half that a ball about the object fills"
        ),
    ] = 0.6
    nearest_m: Annotated[
        float, Field(gt=0, description="The camera comes no nearer than this to the centre when it fits, m")
    ] = 0.15
    home_distance_m: Annotated[
        float, Field(gt=0, description="Distance of the wide views of the detection pass, m")
    ] = 0.8
    workspace_radius_m: Annotated[
        float, Field(gt=0, description="The camera stays within this horizontal distance of the origin, m")
    ] = 1.5
    workspace_height_m: Annotated[
        tuple[float, float], Field(description="Lowest and highest camera above the table, m")
    ] = (0.03, 1.5)


@dataclass(frozen=True)
class Station:
    """A place of the camera.

    Attributes:
        name: "top", "outer-0", "inner-3", ...
        transform_camera_to_world: Pose of the optical frame, shape (4, 4).
    """

    name: str
    transform_camera_to_world: FloatArray


def fit_stations(parameters: StationParameters, intrinsics: Intrinsics, radius_m: float) -> StationParameters:
    """Scale a station set's distances, all by one factor, so that the object fills the image as wished.

    Args:
        parameters: The station set; returned as it is if ``fit`` is off.
        intrinsics: The camera's.
        radius_m: Of a ball about the object's centre that holds it.

    Returns:
        The same directions; the nearest station shows the ball as large as asked, or is at ``nearest_m``.
    """
    distances = [parameters.top_distance_m] if parameters.top else []
    for ring in (parameters.outer, parameters.inner):
        if ring.count and ring.radius_m > 0.0 and 0.0 < ring.angle_deg < 90.0:
            distances.append(ring.radius_m / float(np.sin(np.radians(ring.angle_deg))))
    if not parameters.fit or not distances:
        return parameters
    k = intrinsics
    half = min(min(k.cx, k.width - k.cx) / k.fx, min(k.cy, k.height - k.cy) / k.fy)
    wanted = radius_m / float(np.sin(np.arctan(parameters.fill * half)))
    factor = max(wanted, parameters.nearest_m) / min(distances)
    return replace(
        parameters,
        top_distance_m=factor * parameters.top_distance_m,
        outer=replace(parameters.outer, radius_m=factor * parameters.outer.radius_m),
        inner=replace(parameters.inner, radius_m=factor * parameters.inner.radius_m),
    )


def place_stations(centre: FloatArray, parameters: StationParameters) -> tuple[Station, ...]:
    """Place the stations about the estimated centre of the object, every optical axis through it.

    Args:
        centre: Estimated centre in the world, shape (3,).
        parameters: The station set.

    Returns:
        The top view, the outer ring, the inner ring; what is switched off is left out.

    Raises:
        StationError: A ring is degenerate, a station is outside the workspace, or fewer than three
            stations are left.
    """
    stations = []
    if parameters.top:
        position = centre + np.array([0.0, 0.0, parameters.top_distance_m])
        stations.append(_station("top", position, centre, parameters))
    for name, ring in (("outer", parameters.outer), ("inner", parameters.inner)):
        for i, position in enumerate(_ring_positions(name, ring, centre)):
            stations.append(_station(f"{name}-{i}", position, centre, parameters))
    if len(stations) < MINIMUM_VIEWS:
        raise StationError(
            f"{len(stations)} camera stations are too few to see an object from all around",
            remedy=f"ask for at least {MINIMUM_VIEWS}, see stations.outer.count",
            stations=len(stations),
        )
    return tuple(stations)


def _ring_positions(name: str, ring: Ring, centre: FloatArray) -> FloatArray:
    """Return the optical centres of a ring, shape (count, 3)."""
    if ring.count == 0:
        return np.empty((0, 3))
    if ring.radius_m <= 0.0:
        raise StationError(
            f"the {name} ring's radius is {ring.radius_m:g} m, so all its stations coincide",
            remedy=f"make stations.{name}.radius_m positive or set stations.{name}.count=0",
            radius_m=ring.radius_m,
        )
    if not 0.0 < ring.angle_deg < 90.0:
        raise StationError(
            f"the {name} ring's optical axes make {ring.angle_deg:g} deg with the vertical",
            remedy=f"choose stations.{name}.angle_deg between 0 and 90, both excluded",
            angle_deg=ring.angle_deg,
        )
    azimuth = np.radians(ring.phase_deg) + 2.0 * np.pi * np.arange(ring.count) / ring.count
    height = ring.radius_m / np.tan(np.radians(ring.angle_deg))
    offset = np.column_stack(
        (ring.radius_m * np.cos(azimuth), ring.radius_m * np.sin(azimuth), np.full(ring.count, height))
    )
    positions: FloatArray = centre + offset
    return positions


def _station(name: str, position: FloatArray, centre: FloatArray, parameters: StationParameters) -> Station:
    """Aim a station at the centre, inside the workspace."""
    low, high = parameters.workspace_height_m
    if not low <= position[2] <= high:
        raise StationError(
            f"station {name} is {position[2]:.3f} m above the table, "
            f"the workspace spans {low:g} to {high:g} m",
            remedy="change the ring's radius or angle, or stations.workspace_height_m",
            station=name,
            position=tuple(position),
        )
    reach = float(np.hypot(position[0], position[1]))
    if reach > parameters.workspace_radius_m:
        raise StationError(
            f"station {name} is {reach:.3f} m from the origin, the workspace ends at "
            f"{parameters.workspace_radius_m:g} m",
            remedy="choose a smaller ring or a larger stations.workspace_radius_m",
            station=name,
            position=tuple(position),
        )
    return Station(name, look_at(position, centre))
