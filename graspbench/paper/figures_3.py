"""Figures 3.3, 3.5, 3.10 and 3.11 of the thesis, drawn from trials."""

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from graspbench.config.trial_config import TrialConfig, load_config
from graspbench.errors import ConfigurationError
from graspbench.paper.paper_result import AS_IN_THE_THESIS, PaperResult, Say, published
from graspbench.planning import centre_gain, centre_option, fingertip_paths, grip_geometry
from graspbench.planning.barrier import BarrierValues, KinematicBarrier, barrier_force
from graspbench.planning.indices.force_field import FieldForces, ForceFieldParameters, field_forces
from graspbench.results.plain import to_json
from graspbench.results.store import SCHEMA_VERSION, write_atomically
from graspbench.trial.clock import StageClock
from graspbench.trial.planned import PlannedTrial, planned_trial

OBJECTS = {"teddy": 3, "bottle": 4}
"""The objects of the figures, each with its number of fingers."""

# Under the thesis' assumption, forces in the plane without friction: there the bottle is grasped level.
_DEFAULTS = (*AS_IN_THE_THESIS, "quality=thesis")
_TITLE = "Grasps of figure 3.11"
_SHOWN = ("object", "fingers", "k_cm", "equilateral_error_deg", "plane_offset_mm", "area_cm2", "q3")


def figures_3(
    output: Path,
    overrides: Sequence[str],
    jobs: int,
    config_dir: Path | None,
    say: Say,
    *,
    forces: bool = False,
) -> PaperResult:
    """Draw reconstruction, planning and grasps, with and without the pull to the centroid.

    Args:
        output: Folder of figures and tables.
        overrides: Options of the trials; an object among them takes the place of the thesis' two.
        jobs: Not used.
        config_dir: A user's folder of options.
        say: Told about the progress.
        forces: Whether force field and barrier at the contacts are drawn too.

    Raises:
        ConfigurationError: An option cannot be used, or forces are asked of another index.
        TrialError: A trial ends without a grasp.
    """
    configs = _configs(overrides, config_dir)
    if forces and any(not isinstance(config.index, ForceFieldParameters) for config in configs):
        raise ConfigurationError(
            f"the index {configs[0].index_name} has no force field to draw", remedy="leave out --forces"
        )
    rows: list[dict[str, Any]] = []
    files: list[Path] = []
    with published(output) as folder:
        for config, trial, row in _planned(configs, say):
            files += _draw(config, trial, row, folder)
            if forces:
                files.append(_draw_forces(config, trial, row, folder))
            rows.append(row)
        files = [*dict.fromkeys(files), *_write_tables(rows, configs, folder), folder / "result.json"]
        write_atomically(files[-1], to_json({"schema": SCHEMA_VERSION, "rows": rows}))
    shown = [{key: row[key] for key in _SHOWN} for row in rows]
    return PaperResult(shown, {"rows": rows}, [output / path.name for path in files])


def thesis_rows(overrides: Sequence[str], config_dir: Path | None = None) -> list[dict[str, Any]]:
    """Return the table of the figures' grasps, without the figures.

    Args:
        overrides: Options of the trials; an object among them takes the place of the thesis' two.
        config_dir: A user's folder of options.

    Raises:
        ConfigurationError: An option cannot be used.
        TrialError: A trial ends without a grasp.
    """
    return [row for _, _, row in _planned(_configs(overrides, config_dir), lambda text: None)]


def _planned(
    configs: Sequence[TrialConfig], say: Say
) -> Iterator[tuple[TrialConfig, PlannedTrial, dict[str, Any]]]:
    """Yield each trial, planned, and its row; its scene is there until the next one is asked for."""
    for config in configs:
        say(f"{_case(config)}: images, reconstruction and plan")
        with planned_trial(config, StageClock()) as trial:
            yield config, trial, _row(config, trial)


def _configs(overrides: Sequence[str], config_dir: Path | None) -> list[TrialConfig]:
    """Return the trials: the thesis' objects or the one asked for; both k_cm unless one is asked for."""
    named = any(override.startswith("object") for override in overrides)
    objects = [[]] if named else [[f"object={name}", f"hand.fingers={n}"] for name, n in OBJECTS.items()]
    option = centre_option(load_config([*_DEFAULTS, *objects[0], *overrides], config_dir).index_name)
    asked = any(override.startswith(f"index.{option}") for override in overrides)
    gains: list[list[str]] = [[f"index.{option}=1"], [f"index.{option}=0"]] if option and not asked else [[]]
    return [
        load_config([*_DEFAULTS, *chosen, *gain, *overrides], config_dir)
        for chosen in objects
        for gain in gains
    ]


def _case(config: TrialConfig) -> str:
    gain = centre_gain(config.index_name, config.index)
    return f"{config.object.name}, {config.index_name if gain is None else f'k_cm = {gain:g}'}"


def _row(config: TrialConfig, trial: PlannedTrial) -> dict[str, Any]:
    """Return the shape of a grasp and its quality."""
    plan = trial.plan
    shape = grip_geometry(plan.grasp.points, plan.grasp.centroid)
    return {
        "object": trial.name,
        "fingers": config.hand.fingers,
        "k_cm": centre_gain(config.index_name, config.index),
        "equilateral_error_deg": shape.equilateral_error_deg,
        "plane_offset_mm": 1e3 * shape.plane_offset_m,
        "flatness_mm": 1e3 * shape.flatness_m,
        "area_cm2": 1e4 * shape.area_m2,
        "q3": plan.quality.q3,
        "rotations_tried": plan.details.rotations_tried if plan.details else None,
    }


def _draw(config: TrialConfig, trial: PlannedTrial, row: dict[str, Any], output: Path) -> list[Path]:
    """Draw figures 3.10 and 3.11 of one trial, and 3.3 and 3.5 if its object has none yet."""
    from graspbench.report import draw_grasp, draw_surface_moments, pick_moments, style  # loads Matplotlib
    from graspbench.report.planning_figures import draw_travel
    from graspbench.report.station_figure import draw_stations

    plan, planner, case, ending = trial.plan, config.planner, _case(config), _ending(config, trial)
    paths = fingertip_paths(
        plan.history, planner.paths, planner.floating_distance_m, trial.hand, trial.checker.ground_height_m
    )
    caption = (
        f"equilateral within {row['equilateral_error_deg']:.1f}°   "
        f"plane {row['plane_offset_mm']:.1f} mm from the centroid   polygon {row['area_cm2']:.1f} cm²"
    )
    shrinking = output / f"figure_3_5_{trial.name}.png"
    travel, final = output / f"figure_3_10_{ending}", output / f"figure_3_11_{ending}"
    stations = output / f"figure_3_3_{trial.name}.png"
    with style.drawn_as(style.PRINT):
        if not stations.exists():  # an object is looked at alike whatever is planned on it
            title = f"Figure 3.3: stations and way of the camera, {trial.name}"
            draw_stations(trial.views, trial.surfaces[-1], stations, title)
            title = f"Figure 3.5: preshape and reconstruction, {trial.name}"
            draw_surface_moments(pick_moments(trial.surfaces), shrinking, title)
        draw_travel(trial.surfaces, plan.history, travel, f"Figure 3.10: planning, {case}")
        title = f"Figure 3.11: {case}"
        draw_grasp(trial.surfaces[-1], plan.grasp, paths, final, title=title, caption=caption)
    return [stations, shrinking, travel, final]


def _draw_forces(config: TrialConfig, trial: PlannedTrial, row: dict[str, Any], output: Path) -> Path:
    """Draw force field and barrier at the grasp, and add their values to the row."""
    from graspbench.report import style
    from graspbench.report.planning_figures import draw_forces  # loads Matplotlib

    field, values = _forces(config, trial)
    row["forces_n"] = dataclasses.asdict(field)
    row["barrier_n"] = dataclasses.asdict(values)
    path = output / f"forces_{_ending(config, trial)}"
    title = f"Force field at the grasp: {_case(config)}"
    with style.drawn_as(style.PRINT):
        return draw_forces(trial.surfaces[-1], trial.plan.grasp, field, values, path, title)


def _ending(config: TrialConfig, trial: PlannedTrial) -> str:
    gain = centre_gain(config.index_name, config.index)
    return f"{trial.name}.png" if gain is None else f"{trial.name}_k_cm_{gain:g}.png"


def _forces(config: TrialConfig, trial: PlannedTrial) -> tuple[FieldForces, BarrierValues]:
    """Return the field at the final contacts, and the barrier at the contour points around them."""
    surface, grasp = trial.surfaces[-1], trial.plan.grasp
    assert grasp.posture is not None, "a plan made with a checker has a posture"
    barrier = KinematicBarrier(trial.hand, trial.checker.ground_height_m, config.local_planner.barrier)
    values = barrier.values(surface, grasp.vertices, grasp.posture)
    repulsion = barrier_force(surface.points, values.nodes, values.total)
    field = field_forces(grasp.points, grasp.normals, grasp.centroid, config.index, repulsion)
    return field, values


def _write_tables(rows: list[dict[str, Any]], configs: Sequence[TrialConfig], output: Path) -> list[Path]:
    from graspbench.report.tables import Column, Table, write_tables

    columns = (
        Column("object", "object"),
        Column("fingers", "fingers", format="d"),
        Column("k_cm", "k_cm", format="g"),
        Column("equilateral_error_deg", "equilateral error", "deg", ".2f"),
        Column("plane_offset_mm", "plane to centroid", "mm", ".2f"),
        Column("area_cm2", "polygon", "cm²", ".2f"),
        Column("q3", "Q3", format=".3f"),
    )
    notes = (
        "Equilateral error: the largest deviation of an angle between neighbouring contacts.",
        "The best by the index of all grasps that followed the surface, unless planner.select is given.",
        *(f"Q3: {model}." for model in dict.fromkeys(config.quality.describe() for config in configs)),
    )
    return list(write_tables([Table("table", _TITLE, columns, tuple(rows), notes)], output))
