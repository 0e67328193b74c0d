"""What each stage of the reconstruction costs, and how that grows with nodes and images."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspbench.bench.exact_silhouettes import exact_silhouettes
from graspbench.bench.photographs import Photographs
from graspbench.bench.timing import best_time
from graspbench.perception.camera import Camera, CameraParameters
from graspbench.perception.silhouette import Silhouette
from graspbench.perception.stations import Ring, StationParameters, place_stations
from graspbench.perception.triangulation import triangulate_centre
from graspbench.reconstruction import SurfaceParameters, VisualHull, preshape, reconstruct

NODES = (500, 1000, 1502, 3000, 6000, 12000, 24000)
IMAGES = (4, 7, 13, 20, 30, 40)
QUICK_NODES, QUICK_IMAGES = (100, 200, 400), (4, 7)
USUAL_IMAGES = 13

Row = dict[str, object]


@dataclass(frozen=True)
class StageTimes:
    """Shortest times of the stages (s).

    Attributes:
        fields_s: The silhouettes' distance fields.
        preshape_s: The ellipsoid.
        elastic_s: The motion from the ellipsoid to rest, without snapshots between.
        total_s: From silhouettes to the surface at rest, without snapshots between.
        anytime_s: The same with all the snapshots that planners read.
        steps: Steps of the motion.
    """

    fields_s: float
    preshape_s: float
    elastic_s: float
    total_s: float
    anytime_s: float
    steps: int

    def milliseconds(self) -> Row:
        """Return the times as part of a row."""
        return {
            "fields_ms": 1e3 * self.fields_s,
            "preshape_ms": 1e3 * self.preshape_s,
            "elastic_ms": 1e3 * self.elastic_s,
            "total_ms": 1e3 * self.total_s,
            "anytime_ms": 1e3 * self.anytime_s,
            "steps": self.steps,
        }


def stage_times(silhouettes: Sequence[Silhouette], parameters: SurfaceParameters, repeats: int) -> StageTimes:
    """Measure the stages of a reconstruction."""
    centre = triangulate_centre(silhouettes)
    straight = replace(parameters, snapshot_every=parameters.max_iterations)
    fields_s, hull = best_time(
        lambda: VisualHull(silhouettes, parameters.ground, smoothing_px=parameters.smoothing_px), repeats
    )
    preshape_s, _ = best_time(lambda: preshape(silhouettes, centre, parameters, hull=hull), repeats)
    elastic_s, steps = np.inf, 0
    for _ in range(repeats):
        surfaces = reconstruct(silhouettes, straight)
        next(surfaces)
        once_s, rest = best_time(lambda moving=surfaces: list(moving), 1)  # type: ignore[misc]
        elastic_s, steps = min(elastic_s, once_s), rest[-1].iteration
    total_s, _ = best_time(lambda: list(reconstruct(silhouettes, straight)), repeats)
    anytime_s, _ = best_time(lambda: list(reconstruct(silhouettes, parameters)), repeats)
    return StageTimes(fields_s, preshape_s, elastic_s, total_s, anytime_s, steps)


def cost_rows(photographs: Photographs, parameters: SurfaceParameters, quick: bool) -> list[Row]:
    """Measure one object with more and more nodes, then with more and more images.

    The images here are perfect ones: taking forty by the camera would only take longer.
    """
    repeats = 2 if quick else 12
    usual = _perfect(photographs, USUAL_IMAGES)
    list(reconstruct(usual, parameters))
    rows = []
    for nodes in QUICK_NODES if quick else NODES:
        times = stage_times(usual, replace(parameters, nodes=nodes), repeats)
        rows.append({"over": "nodes", "nodes": nodes, "images": USUAL_IMAGES, **times.milliseconds()})
    for images in QUICK_IMAGES if quick else IMAGES:
        times = stage_times(_perfect(photographs, images), parameters, repeats)
        rows.append({"over": "images", "nodes": parameters.nodes, "images": images, **times.milliseconds()})
    return rows


def growth_rows(cost: Sequence[Row]) -> Iterator[Row]:
    """Fit a line and a power law to the total cost, over nodes and over images."""
    for over in ("nodes", "images"):
        chosen = [row for row in cost if row["over"] == over]
        x = np.array([row[over] for row in chosen], dtype=np.float64)
        y = np.array([row["total_ms"] for row in chosen], dtype=np.float64)
        slope, offset = np.polyfit(x, y, 1)
        yield {
            "over": over,
            "offset_ms": float(offset),
            "ms_per_hundred": 100.0 * float(slope),
            "line_r2": float(np.corrcoef(x, y)[0, 1] ** 2),
            "exponent": float(np.polyfit(np.log(x), np.log(y), 1)[0]),
        }


def _perfect(photographs: Photographs, images: int) -> tuple[Silhouette, ...]:
    """Return perfect silhouettes from a top view and two rings, twice as many on the outer one."""
    outer = round((images - 1) * 2 / 3)
    rings = StationParameters(outer=Ring(outer), inner=Ring(images - 1 - outer, 0.28, 35.0, 22.5))
    stations = place_stations(photographs.centre, rings)
    intrinsics = CameraParameters().intrinsics
    cameras = [Camera(intrinsics, station.transform_camera_to_world) for station in stations]
    names = [station.name for station in stations]
    return exact_silhouettes(photographs.vertices, photographs.faces, cameras, names)
