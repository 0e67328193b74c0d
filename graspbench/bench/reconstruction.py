"""The elastic surface against its peers, on the same silhouettes; what it costs, and how that grows.

Images come from the simulated camera under the default light. Peers are voxel carving, our own and
Open3D's, in the tightest cube around the hull, and bisection of each node's ray. Errors are those
against the visual hull that perfect images of four times the resolution would give, and against the object;
the largest error is also given against the hull of the images as they are. Times are processor times.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from graspbench.arrays import FloatArray
from graspbench.bench.accuracy import Accuracy, Reference, build_reference, measure, measure_hull
from graspbench.bench.photographs import Photographs, photograph
from graspbench.bench.reconstruction_cost import cost_rows, growth_rows, stage_times
from graspbench.bench.reconstruction_plot import draw_reconstruction_bench
from graspbench.bench.result import BenchResult
from graspbench.bench.timing import best_time
from graspbench.bench.voxels import carve_masks, open3d_carving, surface_net, tight_box
from graspbench.config.trial_config import TrialConfig, load_config
from graspbench.errors import ConfigurationError
from graspbench.geometry import object_name
from graspbench.perception.silhouette import Silhouette
from graspbench.reconstruction import Surface, SurfaceParameters, reconstruct

OBJECTS = ("teddy", "bottle", "easter_egg", "duck")
VOXELS = 128
OPEN3D = f"Open3D carve, {VOXELS}^3"

SHOWN = (
    "object", "method", "time_ms", "hull_mean_mm", "seen_hull_hausdorff_mm", "iou", "speedup_vs_open3d",
)  # fmt: skip

Row = dict[str, object]


def run(
    output_dir: Path | None = None, *, objects: Sequence[str] = OBJECTS, quick: bool = False
) -> BenchResult:
    """Measure all methods on all objects, then the cost over nodes and images.

    Args:
        output_dir: Where the plot goes; None draws none.
        objects: Names in the catalogue, or mesh files (in m, repaired where need be); the cost is that on the
            first.
        quick: Measure once, on coarse references, few nodes and few images: to see whether it works.

    Raises:
        ConfigurationError: There is no such object.
        MeshError: A file is no mesh that can be used.
        TrialError: An object cannot be seen or reconstructed.
    """
    if not objects:
        raise ConfigurationError("there is no object to measure", remedy="name one, such as teddy")
    configs = [load_config(_chosen(name)) for name in objects]
    rows: list[Row] = []
    stages: list[Row] = []
    seen: list[Photographs] = []
    for config in configs:
        photographs = photograph(config, repeats=1 if quick else 3)
        seen.append(photographs)
        rows += _object_rows(config, photographs, quick)
        stages.append(_stage_row(config, photographs, quick))
    cost = cost_rows(seen[0], configs[0].surface, quick)
    tables: dict[str, tuple[Row, ...]] = {
        "stages": tuple(stages),
        "cost": tuple(cost),
        "growth": tuple(growth_rows(cost)),
    }
    figures = () if output_dir is None else (draw_reconstruction_bench(rows, cost, output_dir),)
    return BenchResult("reconstruction", tuple(rows), figures, tables, SHOWN)


def _chosen(name: str) -> list[str]:
    """Return the overrides that choose an object by its name or its file."""
    if Path(name).suffix:
        return ["object=mesh", f"object.mesh={json.dumps(name)}", "object.repair=true"]
    return [f"object={name}"]


def _object_rows(config: TrialConfig, photographs: Photographs, quick: bool) -> Iterator[Row]:
    """Yield one row a method."""
    reference = build_reference(
        photographs.vertices,
        photographs.faces,
        photographs.true_cameras,
        photographs.silhouettes,
        spacing_m=1.5e-3 if quick else 1.0e-3,
        ground=config.surface.ground,
    )
    rows = [
        *_surface_rows(config.surface, photographs.silhouettes, reference, quick),
        *_voxel_rows(photographs, reference, quick),
        _row("visual hull itself", None, measure_hull(reference)),
    ]
    carved = next(row for row in rows if row["method"] == OPEN3D)
    for row in rows:
        yield {
            "object": object_name(config.object),
            **row,
            "speedup_vs_open3d": _ratio(carved["time_ms"], row["time_ms"]),
            "error_vs_open3d": _ratio(row["hull_mean_mm"], carved["hull_mean_mm"]),
        }


def _surface_rows(
    parameters: SurfaceParameters, silhouettes: Sequence[Silhouette], reference: Reference, quick: bool
) -> Iterator[Row]:
    """Measure the reconstructions that end with a network of nodes."""
    parameters = replace(parameters, method="elastic")
    tight = replace(parameters, pull="normal", wrap="hull")
    methods = (
        ("elastic", parameters, 20),
        ("elastic, pull=normal", tight, 1),
        ("radial bisection", replace(parameters, method="radial"), 5),
        ("hull net", replace(parameters, method="hull_net", levels=1), 5),
    )
    for name, chosen, repeats in methods:
        if quick:
            chosen = replace(chosen, nodes=402, refinement_steps=5)
        # Voxels come without snapshots on the way, too.
        chosen = replace(chosen, snapshot_every=chosen.max_iterations)
        _resting(silhouettes, replace(chosen, refinement_steps=1))()  # compiles it
        once = _resting(silhouettes, chosen)
        seconds, surface = best_time(once, 1 if quick else repeats)
        accuracy = measure(surface.points, surface.network.faces, reference)
        nodes = reference.hull.distances_from(surface.points)
        yield _row(name, seconds, accuracy, nodes=nodes, genus=surface.network.genus)


def _resting(silhouettes: Sequence[Silhouette], parameters: SurfaceParameters) -> Callable[[], Surface]:
    def once() -> Surface:
        *_, last = reconstruct(silhouettes, parameters)
        return last

    return once


def _voxel_rows(photographs: Photographs, reference: Reference, quick: bool) -> Iterator[Row]:
    """Measure the methods that end with voxels; the making of a surface from these is not timed."""
    silhouettes = photographs.silhouettes
    low, high = reference.hull.points.min(axis=0), reference.hull.points.max(axis=0)
    box = tight_box(low, high, VOXELS)
    carve_masks(silhouettes, tight_box(low, high, 8))  # compiles it
    seconds, occupied = best_time(lambda: carve_masks(silhouettes, box), 1 if quick else 5)
    yield _row(f"mask carve, {VOXELS}^3", seconds, measure(*surface_net(occupied, box), reference))
    peer = open3d_carving(silhouettes, box)
    if peer is None:
        yield _row(OPEN3D, None, None, note="not installed: pip install graspbench[bench]")
        return
    carve, read = peer
    seconds, grid = best_time(carve, 1 if quick else 2)
    yield _row(OPEN3D, seconds, measure(*surface_net(read(grid), box), reference))


def _row(
    method: str,
    seconds: float | None,
    accuracy: Accuracy | None,
    *,
    nodes: FloatArray | None = None,
    genus: int | None = None,
    note: str = "",
) -> Row:
    a = accuracy
    return {
        "method": method,
        "time_ms": None if seconds is None else 1e3 * seconds,
        "nodes": None if nodes is None else len(nodes),
        "genus": genus,
        "node_hull_mean_mm": None if nodes is None else 1e3 * float(nodes.mean()),
        "hull_mean_mm": a and 1e3 * a.hull_mean_m,
        "hull_hausdorff_mm": a and 1e3 * a.hull_hausdorff_m,
        "seen_hull_hausdorff_mm": a and 1e3 * max(a.to_seen_hull_m, a.from_seen_hull_m),
        "surface_to_seen_hull_mm": a and 1e3 * a.to_seen_hull_m,
        "seen_hull_to_surface_mm": a and 1e3 * a.from_seen_hull_m,
        "object_mean_mm": a and 1e3 * a.object_mean_m,
        "object_hausdorff_mm": a and 1e3 * a.object_hausdorff_m,
        "iou": a and a.iou,
        "note": note,
    }


def _stage_row(config: TrialConfig, photographs: Photographs, quick: bool) -> Row:
    """Measure the stages one by one, with the configured surface."""
    times = stage_times(photographs.silhouettes, config.surface, 1 if quick else 20)
    return {
        "object": object_name(config.object),
        "images": len(photographs.silhouettes),
        "all_images_ms": 1e3 * photographs.images_s,
        "silhouette_ms": 1e3 * photographs.silhouettes_s / len(photographs.silhouettes),
        **times.milliseconds(),
    }


def _ratio(a: Any, b: Any) -> float | None:
    return None if a is None or b is None else float(a) / float(b)
