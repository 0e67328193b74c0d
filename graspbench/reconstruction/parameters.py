"""Parameters of the preshape and of the reconstruction surface."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import Field

MAX_NODES = 100_000
"""Sample points of a surface; all that is planned on one of more would take hours."""


@dataclass(frozen=True)
class SurfaceParameters:
    """Everything that shapes the reconstruction surface (thesis 3.2.3 and 3.3).

    The defaults are the thesis' values where it gives any.
    """

    method: Annotated[str, Field(description="Registered reconstruction that makes the surface")] = "elastic"
    nodes: Annotated[int, Field(ge=5, le=MAX_NODES, description="Wanted number of sample points n_s")] = 1502
    meridians: Annotated[int | None, Field(ge=3, description="Number of meridians n_m; null: from nodes")] = (
        None
    )
    parallels: Annotated[int | None, Field(ge=1, description="Number of parallels n_p; null: from nodes")] = (
        None
    )
    pole_thinning: Annotated[
        float,
        Field(ge=0, le=1, description="Parallels' spacing: 0 even angles, 1 even areas (thin at the poles)"),
    ] = 0.5
    ground: Annotated[bool, Field(description="Cut the visual hull and the preshape at the plane z = 0")] = (
        True
    )
    wrap: Annotated[
        Literal["polyhedron", "hull"],
        Field(
            description="What the first ellipsoid wraps: the bounding boxes' polyhedron or the visual hull"
        ),
    ] = "polyhedron"
    margin: Annotated[float, Field(ge=1, le=3, description="Enlargement of the wrapping ellipsoid")] = 1.05
    pull: Annotated[
        Literal["centroid", "normal"],
        Field(description="Direction of the pull; normal also reaches parts hidden from the centroid"),
    ] = "centroid"
    dynamics: Annotated[
        Literal["velocity_reset", "overdamped", "damped"],
        Field(
            description="Reading of the equation of motion: speed zeroed at crossings, mass dropped, as is"
        ),
    ] = "velocity_reset"
    mass_kg: Annotated[float, Field(gt=0, description="Mass m of a sample point")] = 1e-3
    stiffness_n_per_m: Annotated[float, Field(ge=0, description="Spring constant k of a link")] = 0.3e-3
    damping_ns_per_m: Annotated[float, Field(ge=0, description="Damper b of a sample point")] = 0.09e-3
    pull_n: Annotated[float, Field(gt=0, description="Largest force F_a of the pull")] = 5.0
    pull_decay: Annotated[
        float, Field(gt=0, lt=1, description="Factor epsilon of the pull at each crossing of the border")
    ] = 0.5
    time_step_s: Annotated[float, Field(gt=0, description="Integration step")] = 1e-4
    rest_step_m: Annotated[
        float, Field(gt=0, description="A surface at rest moves less than this a step")
    ] = 0.05e-3
    rest_count: Annotated[int, Field(ge=1, description="Steps in a row that must be that small")] = 3
    max_iterations: Annotated[int, Field(ge=1, description="Steps after which the surface is given up")] = (
        5000
    )
    refinement_steps: Annotated[
        int, Field(ge=1, le=1000, description="Most steps that pull=normal takes after the surface rests")
    ] = 80
    settle: Annotated[
        bool, Field(description="At rest, put each node on the border where it last crossed it")
    ] = True
    smoothing_px: Annotated[
        float,
        Field(
            ge=0, le=5, description="Gaussian filter of the distance fields; halved where coverage is known"
        ),
    ] = 0.8
    normal_smoothing: Annotated[
        int, Field(ge=0, le=20, description="Averaging passes over the vertex normals' contours")
    ] = 0
    cell_px: Annotated[
        float, Field(ge=0.5, le=50, description="Finest cell of method=hull_net, in pixels at the object")
    ] = 4.2
    levels: Annotated[
        int,
        Field(ge=1, le=5, description="Grids of method=hull_net, each twice as fine as the one before"),
    ] = 3
    relaxations: Annotated[
        int, Field(ge=0, le=100, description="Elastic steps of each net of method=hull_net")
    ] = 5
    relaxation_stiffness: Annotated[
        float,
        Field(ge=0.001, le=10, description="Springs of these steps against the hull's tangent planes"),
    ] = 0.1
    snapshot_every: Annotated[int, Field(ge=1, description="Integration steps between two snapshots")] = 4
    options: Annotated[
        Mapping[str, Any], Field(description="Free options for reconstructions registered by others")
    ] = field(default_factory=dict)
