"""Local, refined and global grasps of trials beside each other, measure by measure (thesis table 3.1)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.grasp.distance import contact_distance_m
from graspbench.planning import grip_geometry
from graspbench.report.columns import MEASURES
from graspbench.report.comparison import TITLE, thesis_ratio
from graspbench.report.tables import Column, Table
from graspbench.results.grasp_results import GraspResult
from graspbench.results.trial_result import TrialResult

REFINED_GOAL = 0.97
_MODEL = ("contact", "wrench_space", "friction", "cone_edges", "torque_length", "norm")
"""What the measures are of: columns of the CSV, words in the notes."""

COLUMNS = (
    Column("object", "object"),
    Column("fingers", "fingers", format="d"),
    Column("k_cm", "k_cm", format="g"),
    Column("measure", "measure"),
    Column("local", "local", format=".3f"),
    Column("restarted", "restarted", format=".3f"),
    Column("refined", "refined", format=".3f"),
    Column("global", "global", format=".3f"),
    Column("gap", "gap", format=".3f"),
    Column("optimal", "certified", narrow=False),
    Column("ratio", "local / global", format=".3f"),
    Column("thesis", "thesis", format=".3f"),
    Column("met", "met", narrow=False),
    Column("ratio_restarted", "restarted / global", format=".3f"),
    Column("ratio_refined", "refined / global", format=".3f"),
    Column("serial_s", "serial", "s", ".2f"),
    Column("parallel_s", "parallel", "s", ".2f"),
    Column("speedup", "serial / parallel", format=".1f", narrow=False),
    Column("distance_mm", "distance", "mm", ".1f"),
)
"""What people see; the columns that follow from others are left out where room is short."""


def comparison_rows(result: TrialResult) -> list[dict[str, Any]]:
    """Return a trial's rows, one a measure that was searched; none of a trial that failed.

    Args:
        result: The trial's result.
    """
    if result.status != "done":
        return []
    return [_row(result, measure) for measure in MEASURES if measure in result.global_]


def contacts(found: GraspResult) -> FloatArray:
    """Return a grasp's contact points, shape (n_f, 3), m."""
    return np.array([contact.point for contact in found.contacts])


def is_short(row: Mapping[str, Any]) -> bool:
    """Tell whether a row falls short of the thesis' ratio, or its refined grasp of what it should reach."""
    refined = row["ratio_refined"]
    return row["met"] == "no" or (refined is not None and refined < REFINED_GOAL)


def reason(row: Mapping[str, Any], result: TrialResult, span_m: float) -> str:
    """Say in one sentence how the grasps of a row differ.

    Args:
        row: One of `comparison_rows`.
        result: The trial's result.
        span_m: How far apart the hand reaches at all.
    """
    found, local = result.global_[row["measure"].lower()], result.local
    assert local is not None, "a trial that is done has a grasp"
    centroid = np.array(local.centroid)
    wide, turned, away = zip(*(_shape(contacts(grasp), centroid) for grasp in (found, local)), strict=True)
    text = (
        f"the global grasp is {wide[0]:.0f} mm wide (local {wide[1]:.0f}; the hand spans "
        f"{1e3 * span_m:.0f}), "
        f"{turned[0]:.0f}° from equilateral (local {turned[1]:.0f}, as its index wants), and its centre is "
        f"{away[0]:.1f} mm from the centroid (local {away[1]:.1f})"
    )
    if row["ratio_refined"] is not None and row["ratio_refined"] < REFINED_GOAL:
        gap = contact_distance_m(contacts(result.refined[row["measure"].lower()]), contacts(found))
        text += f"; the refined grasp is on another summit, {1e3 * gap:.0f} mm a contact from the global one"
    if not row["optimal"] and row["gap"] is not None:
        text += f"; the optimum is known within {100 * row['gap']:.1f} % only"
        if found.optimal_up_to_solver and found.doubtful is not None:
            text += f": {found.doubtful} better grasps were refused by the posture solver, no proof"
    return text[0].upper() + text[1:] + "."


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what the rows say in all."""
    ratios = [row["ratio"] for row in rows if row["ratio"] is not None]
    refined = [row["ratio_refined"] for row in rows if row["ratio_refined"] is not None]
    restarted = [row["ratio_restarted"] for row in rows if row["ratio_restarted"] is not None]
    thesis = [row for row in rows if row["thesis"] is not None]
    return {
        "mean_ratio": float(np.mean(ratios)) if ratios else None,
        "tenth_percentile_ratio": float(np.quantile(ratios, 0.1)) if ratios else None,
        "mean_ratio_restarted": float(np.mean(restarted)) if restarted else None,
        "mean_ratio_refined": float(np.mean(refined)) if refined else None,
        "thesis_cells": len(thesis),
        "thesis_cells_met": sum(row["met"] == "yes" for row in thesis),
        "refined_cells": len(refined),
        "refined_cells_met": sum(value >= REFINED_GOAL for value in refined),
        "certified_cells": sum(bool(row["optimal"]) for row in rows),
        "cells": len(rows),
    }


def local_global_table(rows: Sequence[Mapping[str, Any]], notes: Sequence[str]) -> Table:
    """Return the table of rows, with what they say in all below it.

    Args:
        rows: Of `comparison_rows`, of several trials.
        notes: Further sentences.
    """
    told = summary(rows)
    sentences = (
        "Local: the grasp that followed the surface while it formed, evaluated with the measure. Restarted: "
        "a multi-start on the finished surface. Refined: the local grasp after ascent of the measure.",
        f"Mean local / global {_percent(told['mean_ratio'])} (tenth percentile "
        f"{_percent(told['tenth_percentile_ratio'])}), restarted / global "
        f"{_percent(told['mean_ratio_restarted'])}, refined / global "
        f"{_percent(told['mean_ratio_refined'])}; {told['thesis_cells_met']} of {told['thesis_cells']} cells "
        f"reach the thesis' ratio, {told['refined_cells_met']} of {told['refined_cells']} refined ones "
        f"{REFINED_GOAL:g}; {told['certified_cells']} of {told['cells']} optima certified.",
        "Serial: reconstruction, then global search, which knows the local grasp. "
        "Parallel: reconstruction and local planner together.",
        *notes,
    )
    return Table("table", TITLE, COLUMNS, tuple(rows), sentences, parted=("object", "k_cm"))


def compared(
    case: Mapping[str, Any],
    index: str,
    measure: str,
    values: Mapping[str, float | None],
    best: Mapping[str, Any],
    quality: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the part of a row that grasps and search decide.

    Args:
        case: ``object``, ``fingers`` and ``k_cm``.
        index: Name of the index.
        measure: "q1", "q2" or "q3".
        values: Its values: ``local``, ``restarted`` and ``refined``, None where there is none.
        best: ``global`` (None where nothing is known), ``upper_bound``, ``gap`` and ``optimal``.
        quality: What the measures are of: `QualityParameters` as a mapping.
    """
    known = best["global"]
    ratios = {
        name: None if known is None or value is None else value / known for name, value in values.items()
    }
    thesis, ratio = thesis_ratio(case["k_cm"], case["object"], index, measure), ratios["local"]
    return {
        **case,
        "measure": measure.upper(),
        **values,
        **best,
        "ratio": ratio,
        "thesis": thesis,
        "met": None if thesis is None or ratio is None else "yes" if ratio >= thesis else "no",
        "ratio_restarted": ratios["restarted"],
        "ratio_refined": ratios["refined"],
        **_model(quality),
    }


def _model(quality: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the measures are of, None where the model does without."""
    idle = {"friction", "cone_edges"} if quality.get("contact") == "frictionless" else set()
    if str(quality.get("wrench_space")).endswith("_force"):
        idle.add("torque_length")
    return {name: None if name in idle else quality.get(name) for name in _MODEL}


def _row(result: TrialResult, measure: str) -> dict[str, Any]:
    local, found, refined = result.local, result.global_[measure], result.refined.get(measure)
    restarted = result.restarted
    assert local is not None, "a trial that is done has a grasp"
    known = bool(found.contacts) and found.value > 0
    serial_s = local.reconstruction_time_s + found.time_s
    return {
        **compared(
            {"object": result.object.name, "fingers": result.hand.fingers, "k_cm": result.index.get("k_cm")},
            result.index["name"],
            measure,
            {
                "local": local[measure],
                "restarted": restarted[measure] if restarted else None,
                "refined": refined.value if refined else None,
            },
            {
                "global": found.value if known else None,
                "upper_bound": found.upper_bound,
                "gap": found.gap,
                "optimal": found.optimal,
            },
            result.config.get("quality", {}),
        ),
        "found_by": local.found_by,
        "followed_share": local.followed_share,
        "reconstruction_s": local.reconstruction_time_s,
        "search_s": found.time_s,
        "serial_s": serial_s,
        "parallel_s": local.time_s,
        "speedup": serial_s / local.time_s,
        "distance_mm": 1e3 * contact_distance_m(contacts(local), contacts(found)) if known else None,
        "trial_id": result.trial_id,
    }


def _shape(points: FloatArray, centroid: FloatArray) -> tuple[float, float, float]:
    """Return a grasp's width (mm), how far it is from equilateral (deg) and off the centroid (mm)."""
    wide = np.linalg.norm(points[:, None] - points[None], axis=-1).max()
    away = np.linalg.norm(points.mean(axis=0) - centroid)
    return 1e3 * float(wide), grip_geometry(points, centroid).equilateral_error_deg, 1e3 * float(away)


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
