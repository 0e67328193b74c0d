"""Wrinkles of scans: triangles that pierce each other, smoothed or, where they are few, tolerated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.geometry import topology
from graspbench.geometry.inspection import MeshReport, inspect, with_intersections
from graspbench.geometry.intersections import self_intersections

_TOLERATED_SHARE = 0.01
"""Self-intersections in this share of the triangles are wrinkles of a scan, and harm nothing."""

_SMOOTHED_SHARE = 0.005
"""A vertex moves at most so far, as share of the size, where wrinkles are smoothed."""

_MAX_SMOOTHINGS = 3

_BEYOND_REPAIR = "remesh it in a modelling program, since the repair could not put it right"


def smoothed(vertices: FloatArray, faces: IntArray, report: MeshReport) -> tuple[FloatArray, MeshReport]:
    """Look for self-intersections, and smooth what can be smoothed of them."""
    if not (before := self_intersections(vertices, faces)).any():
        return vertices, report
    smooth, left = smooth_wrinkles(vertices, faces, before)
    after = inspect(smooth, faces, report.name, trusted=True)[2]
    if not after.usable or left == before.sum():
        return vertices, with_intersections(report, int(before.sum()))
    done = f"wrinkles of {before.sum() - left} triangles were smoothed"
    return smooth, with_intersections(replace(after, repairs=(*report.repairs, done)), left)


def smooth_wrinkles(vertices: FloatArray, faces: IntArray, pierced: BoolArray) -> tuple[FloatArray, int]:
    """Move the corners of triangles that pierce each other towards their neighbours, as long as that helps.

    Args:
        vertices: Shape (n, 3).
        faces: One closed surface, shape (m, 3).
        pierced: Which triangles pierce each other, shape (m,).

    Returns:
        The vertices, no one farther from its place than a share of the size, and how many triangles are left
        that pierce others.
    """
    low, high = topology.find_edges(faces, len(vertices)).ends.T
    ones = np.ones(2 * len(low))
    links = csr_array((ones, (np.append(low, high), np.append(high, low))), shape=(len(vertices),) * 2)
    reach = _SMOOTHED_SHARE * float(np.ptp(vertices, axis=0).max())
    best = vertices
    for _ in range(_MAX_SMOOTHINGS):
        corners = np.unique(faces[pierced])
        if len(corners) == 0:
            break
        around = links[corners] @ best / links[corners].sum(axis=1)[:, None]
        moved = best.copy()
        moved[corners] = vertices[corners] + np.clip(
            0.5 * (best[corners] + around) - vertices[corners], -reach, reach
        )
        touched = np.any(np.isin(faces, corners), axis=1)
        if (left := self_intersections(moved, faces, touched)).sum() >= pierced.sum():
            break
        best, pierced = moved, left
    return best, int(pierced.sum())


def tolerate_wrinkles(report: MeshReport) -> MeshReport:
    """Turn few self-intersections into a warning; whatever else a repair has left, it cannot put right."""
    problems, warnings = [], list(report.warnings)
    few = report.self_intersecting <= _TOLERATED_SHARE * report.triangles
    for problem in report.problems:
        if problem.kind == "self_intersecting" and few:
            warnings.append(
                f"{report.self_intersecting} triangles are pierced by others, few enough to leave them"
            )
        elif problem.repairable:
            problems.append(replace(problem, remedy=_BEYOND_REPAIR, repairable=False))
        else:
            problems.append(problem)
    return replace(report, usable=not problems, problems=tuple(problems), warnings=tuple(warnings))
