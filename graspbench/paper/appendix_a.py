"""Appendix A of the thesis: Mirtich and Canny's index on two synthesised objects."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graspbench.config.trial_config import TrialConfig, load_config
from graspbench.errors import ConfigurationError, PlanningError
from graspbench.paper.paper_result import AS_IN_THE_THESIS, PaperResult, Say, published
from graspbench.planning import fingertip_paths, make_index
from graspbench.planning.indices.mirtich_canny import mirtich_canny_scores
from graspbench.planning.mirtich_canny_optimum import OuterTriangleOptimum, largest_outer_triangle
from graspbench.planning.without_hand import FreePlan, plan_without_hand
from graspbench.reconstruction import Surface
from graspbench.results.plain import to_json
from graspbench.results.store import SCHEMA_VERSION, write_atomically
from graspbench.trial.planned import reconstructed

_DEFAULTS = (*AS_IN_THE_THESIS, "index=mirtich_canny", "hand.fingers=3")
_STARTS = ("planner.rotations=12",)
_TITLE = "Mirtich and Canny's index on synthesised objects, three fingers"


@dataclass(frozen=True)
class _Case:
    """One figure of the appendix."""

    figure: str
    thesis_cei_deg: float
    thesis_eegi_deg: float


OBJECTS = {
    "trilobe": _Case("A.1", 13.0, 2.2),
    "keystone_prism": _Case("A.2", 9.9, 1.04),
}
"""The objects of figures A.1 and A.2, with the errors that the thesis gives for its own objects."""


def appendix_a(
    output: Path, overrides: Sequence[str], jobs: int, config_dir: Path | None, say: Say
) -> PaperResult:
    """Plan on reconstructed objects and set the grasp beside the best of all triples of nodes.

    Args:
        output: Folder of figures and tables.
        overrides: Options of the trials; an object among them takes the place of the thesis' two.
        jobs: Not used.
        config_dir: A user's folder of options.
        say: Told about the progress.

    Raises:
        ConfigurationError: Not three fingers, or another index.
    """
    named = any(override.startswith("object") for override in overrides)
    choices = [()] if named else [(f"object={name}",) for name in OBJECTS]
    defaults = (*_DEFAULTS, *_STARTS)
    configs = [load_config([*defaults, *choice, *overrides], config_dir) for choice in choices]
    for config in configs:
        _check(config)
    rows, files = [], []
    with published(output) as folder:
        for config in configs:
            row, figure = _run(config, folder, say)
            rows.append(row)
            files.append(figure)
        files += _write_tables(rows, configs[0], folder)
        files.append(folder / "result.json")
        write_atomically(files[-1], to_json({"schema": SCHEMA_VERSION, "rows": rows}))
    shown = [{key: value for key, value in row.items() if key in _SHOWN} for row in rows]
    return PaperResult(shown, {"rows": rows}, [output / path.name for path in files])


def _check(config: TrialConfig) -> None:
    if config.index_name != "mirtich_canny":
        raise ConfigurationError(
            f"appendix A is about the index mirtich_canny, not {config.index_name}",
            remedy="leave the index as it is, or use 'graspbench run'",
        )
    if config.hand.fingers != 3:
        raise ConfigurationError(
            f"the outer triangle of appendix A needs 3 fingers, not {config.hand.fingers}",
            remedy="leave hand.fingers as it is; with 2 'graspbench run index=mirtich_canny' is antipodal",
            n_f=config.hand.fingers,
        )


def _run(config: TrialConfig, output: Path, say: Say) -> tuple[dict[str, Any], Path]:
    """Plan one object's grasp, search all triples, and draw."""
    name = _name(config)
    say(f"{name}: images and reconstruction")
    surfaces = reconstructed(config)
    index = make_index(config.index_name, config.index, 3, config.quality)
    plan = plan_without_hand(surfaces, index, 3, config.local_planner)
    say(f"{name}: planned in {plan.time_s:.1f} s; searching all triples of {len(surfaces[-1].points)} nodes")
    optimum = largest_outer_triangle(surfaces[-1], config.index.phi_cei_deg, config.index.phi_eegi_deg)
    if not len(optimum.vertices):
        raise PlanningError(
            f"no three nodes of '{name}' are within the thresholds",
            remedy="raise index.phi_cei_deg or index.phi_eegi_deg",
        )
    say(f"{name}: {optimum.triples:.3g} triples in {optimum.time_s:.1f} s")
    row = {**_row(config, surfaces[-1], plan, optimum), **_within_thesis_errors(config, surfaces[-1])}
    return row, _draw(config, surfaces[-1], plan, row, output)


def _name(config: TrialConfig) -> str:
    return str(config.object.name)


def _row(
    config: TrialConfig, surface: Surface, plan: FreePlan, optimum: OuterTriangleOptimum
) -> dict[str, Any]:
    """Return the grasp's errors and outer triangle beside the optimum's and the thesis' errors."""
    name, grasp = _name(config), plan.grasp
    case = OBJECTS.get(name)
    cei, eegi, area = (float(value) for value in mirtich_canny_scores(grasp.points, grasp.normals))
    best_cei, best_eegi, _ = mirtich_canny_scores(
        surface.points[optimum.vertices], surface.normals[optimum.vertices]
    )
    return {
        "figure": case.figure if case else None,
        "object": name,
        "nodes": len(surface.points),
        "cei_deg": cei,
        "thesis_cei_deg": case.thesis_cei_deg if case else None,
        "eegi_deg": eegi,
        "thesis_eegi_deg": case.thesis_eegi_deg if case else None,
        "area_cm2": 1e4 * area,
        "optimum_cei_deg": float(best_cei),
        "optimum_eegi_deg": float(best_eegi),
        "optimum_area_cm2": 1e4 * optimum.area_m2,
        "area_ratio": area / optimum.area_m2,
        "phi_cei_deg": config.index.phi_cei_deg,
        "phi_eegi_deg": config.index.phi_eegi_deg,
        "error_weight": config.index.error_weight,
        "starts": plan.starts,
        "moves": plan.moves,
        "planning_time_s": plan.time_s,
        "triples": optimum.triples,
        "triples_measured": optimum.measured,
        "search_time_s": optimum.time_s,
        "contacts_m": (grasp.points - grasp.centroid).tolist(),
        "normals": grasp.normals.tolist(),
        "optimum_contacts_m": (surface.points[optimum.vertices] - surface.centroid).tolist(),
    }


def _within_thesis_errors(config: TrialConfig, surface: Surface) -> dict[str, Any]:
    """Return the largest outer triangle whose errors are at most the thesis', None where there is none.

    It proves that errors beyond the thesis' are not a failure of the planner but the price of the size.
    """
    case, area = OBJECTS.get(_name(config)), None
    if case is not None:
        found = largest_outer_triangle(surface, case.thesis_cei_deg, case.thesis_eegi_deg)
        area = 1e4 * found.area_m2 if len(found.vertices) else None
    return {"area_at_thesis_errors_cm2": area}


def _penalty(weight: float) -> str:
    if weight == 0.0:
        return "errors below the thresholds cost nothing."
    return f"errors at the thresholds cost {weight:.0%} of the triangle (index.error_weight)."


_SHOWN = (
    "object",
    "cei_deg",
    "thesis_cei_deg",
    "eegi_deg",
    "thesis_eegi_deg",
    "area_ratio",
    "area_cm2",
    "area_at_thesis_errors_cm2",
)


def _draw(config: TrialConfig, surface: Surface, plan: FreePlan, row: dict[str, Any], output: Path) -> Path:
    from graspbench.report import style
    from graspbench.report.outer_triangle_figure import draw_outer_triangle  # loads Matplotlib

    planner = config.planner
    paths = fingertip_paths(plan.history, planner.paths, planner.floating_distance_m)
    figure = row["figure"]
    path = output / (f"figure_{figure.replace('.', '_')}.png" if figure else f"{row['object']}.png")
    title = " ".join(filter(None, (f"Figure {figure}:" if figure else "", row["object"].replace("_", " "))))
    caption = (
        f"CEI {row['cei_deg']:.1f}°   EEGI {row['eegi_deg']:.2f}°   "
        f"outer triangle {row['area_cm2']:.1f} cm², "
        f"{row['area_ratio']:.3f} of the largest within {row['phi_cei_deg']:g}° and {row['phi_eegi_deg']:g}°"
    )
    with style.drawn_as(style.PRINT):
        return draw_outer_triangle(surface, plan.grasp, paths, path, title, caption)


def _write_tables(rows: list[dict[str, Any]], config: TrialConfig, output: Path) -> list[Path]:
    from graspbench.report.tables import Column, Table, write_tables

    columns = (
        Column("object", "object"),
        Column("cei_deg", "CEI", "deg", ".1f"),
        Column("thesis_cei_deg", "thesis", "deg", ".1f"),
        Column("eegi_deg", "EEGI", "deg", ".2f"),
        Column("thesis_eegi_deg", "thesis", "deg", ".2f"),
        Column("area_cm2", "outer triangle", "cm²", ".1f"),
        Column("optimum_area_cm2", "largest", "cm²", ".1f"),
        Column("area_ratio", "ratio", format=".3f"),
        Column("area_at_thesis_errors_cm2", "largest within the thesis' errors", "cm²", ".1f"),
        Column("optimum_cei_deg", "CEI of the largest", "deg", ".1f"),
        Column("optimum_eegi_deg", "EEGI of the largest", "deg", ".2f"),
        Column("search_time_s", "search", "s", ".1f"),
    )
    notes = (
        f"Largest: the best of all triples of nodes with CEI <= {config.index.phi_cei_deg:g} deg and "
        f"EEGI <= {config.index.phi_eegi_deg:g} deg, every one considered.",
        "Largest within the thesis' errors: the best of all triples with CEI and EEGI at most the thesis'.",
        "The index alone, no hand; " + _penalty(config.index.error_weight),
        "The thesis' errors are of its own objects, whose sizes it does not give.",
    )
    return list(write_tables([Table("table", _TITLE, columns, tuple(rows), notes)], output))
