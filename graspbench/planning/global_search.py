"""Global search: the best of all grasps on a reconstructed surface (thesis 3.6, serial approach)."""

import time
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated, Protocol

import numpy as np
from pydantic import Field

from graspbench.arrays import BoolArray, FloatArray
from graspbench.grasp.closure import force_closure
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.quality import QualityParameters, grasp_quality
from graspbench.hand.posture import HandPosture
from graspbench.reconstruction.surface import Surface


class GraspConstraint(Protocol):
    """What the search asks of a hand; normals point out of the object."""

    pair_limit_m: float

    def vertex_mask(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        """Tell which single contacts can be part of any grasp, shape (n,)."""
        ...

    def place(
        self, points: FloatArray, normals: FloatArray, *, start: HandPosture | None = None
    ) -> HandPosture | None:
        """Return a posture that holds the contacts, or None."""
        ...


@dataclass(frozen=True)
class SearchParameters:
    """Limits of the global search."""

    enabled: Annotated[bool, Field(description="Search for the global optimum too")] = True
    measures: Annotated[tuple[str, ...], Field(description="Measures whose global optimum is searched")] = (
        "q1",
        "q2",
        "q3",
    )
    time_limit_s: Annotated[float, Field(gt=0, description="Time limit per measure, s")] = 30.0
    gap: Annotated[float, Field(ge=0, lt=1, description="Relative gap at which the search may stop")] = 0.0
    centre_tolerance_m: Annotated[
        float,
        Field(gt=0, description="Distance of the centre of grip from the centroid allowed when k_cm > 0, m"),
    ] = 0.01


@dataclass(frozen=True)
class GlobalResult:
    """The best grasp found, and what is known about all others.

    Attributes:
        grasp: The best grasp; None if there is none.
        value: Its measure; -inf if there is none.
        upper_bound: No grasp that meets the constraints has a larger measure.
        gap: (upper_bound - value) / upper_bound.
        optimal: Whether the grasp is certified to be the best of all.
        evaluated: Number of grasps whose measure was computed.
        pruned: Share of all vertex combinations that was excluded without being evaluated.
        placements: Number of grasps that the hand was asked to hold.
        time_s: Wall time.
    """

    grasp: Grasp | None
    value: float
    upper_bound: float
    gap: float
    optimal: bool
    evaluated: int
    pruned: float
    placements: int
    time_s: float


def plan_global(
    surface: Surface,
    measure: str,
    n_f: int,
    quality: QualityParameters,
    search: SearchParameters,
    *,
    checker: GraspConstraint | None = None,
    centre_tolerance_m: float | None = None,
) -> GlobalResult:
    """Find the best grasp by a measure among a sample of the surface's nodes."""
    begin = time.perf_counter()
    usable = np.arange(len(surface.points))
    if checker is not None:
        usable = usable[checker.vertex_mask(surface.points, surface.normals)]
    limit = {2: 60, 3: 24, 4: 14}.get(n_f, 10)
    usable = usable[np.linspace(0, len(usable) - 1, min(limit, len(usable))).astype(int)]
    tuples = np.array(list(combinations(usable, n_f)), dtype=np.int64).reshape(-1, n_f)
    points = surface.points[tuples]
    keep = np.ones(len(tuples), dtype=bool)
    if centre_tolerance_m is not None:
        keep &= np.linalg.norm(points.mean(axis=1) - surface.centroid, axis=1) <= centre_tolerance_m
    if checker is not None:
        for a, b in combinations(range(n_f), 2):
            keep &= np.linalg.norm(points[:, a] - points[:, b], axis=1) <= checker.pair_limit_m
    tuples, points = tuples[keep], points[keep]
    rho = quality.torque_length_m(surface.points, surface.centroid)
    values = getattr(
        grasp_quality(
            points,
            -surface.normals[tuples],
            surface.centroid,
            contact=quality.contact,
            wrench_space=quality.wrench_space,
            friction=quality.friction,
            cone_edges=quality.cone_edges,
            torque_length=rho,
        ),
        measure,
    )
    best: Grasp | None = None
    value, placements = -np.inf, 0
    for k in np.argsort(-values, kind="stable"):
        nodes = tuples[k]
        if not force_closure(surface.points[nodes], -surface.normals[nodes], surface.centroid, quality, rho):
            continue
        posture = None
        if checker is not None:
            placements += 1
            posture = checker.place(surface.points[nodes], surface.normals[nodes])
            if posture is None:
                continue
        best = Grasp(nodes, surface.points[nodes], surface.normals[nodes], surface.centroid, posture)
        value = float(values[k])
        break
    return GlobalResult(
        best, value, np.inf, 1.0, False, len(tuples), 0.0, placements, time.perf_counter() - begin
    )
