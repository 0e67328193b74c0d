"""Table 3.1 of the thesis: local grasps against the global optimum of each quality measure."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from graspbench.config.trial_config import TrialConfig, load_config
from graspbench.grasp import Grasp
from graspbench.hand import GraspChecker, load_hand
from graspbench.paper.paper_result import AS_IN_THE_THESIS, PaperResult, Say, published
from graspbench.planning import centre_gain, centre_option
from graspbench.reconstruction import Surface
from graspbench.results.grasp_results import GraspResult
from graspbench.results.plain import to_json
from graspbench.results.store import SCHEMA_VERSION, ResultStore, write_atomically
from graspbench.results.trial_result import TrialResult
from graspbench.sweep.grid import SweepOptions, SweepTrial, plan_sweep, run_sweep
from graspbench.trial.planned import reconstructed

OBJECTS = {"bottle": 4, "teddy": 3, "cylinder": 3, "easter_egg": 3, "glass": 3, "duck": 3}
"""The thesis' two objects first, each with its number of fingers; then the others it names."""

# The multi-start on the finished surface stands beside the parallel planner; nothing is executed or drawn.
_DEFAULTS = (
    *AS_IN_THE_THESIS,
    "planner.restart=true",
    "search.refine=true",
    "execution=off",
    "record=off",
)
_SHOWN = (
    "object", "k_cm", "measure", "ratio", "thesis", "met", "ratio_restarted", "ratio_refined", "gap",
    "speedup", "distance_mm",
)  # fmt: skip

Rows = list[dict[str, Any]]


def table_3_1(
    output: Path, overrides: Sequence[str], jobs: int, config_dir: Path | None, say: Say
) -> PaperResult:
    """Compare local and global grasps on every object, with and without the pull to the centroid.

    Trials that are in the folder already are not run again.

    Args:
        output: Folder of the trials, tables and pictures.
        overrides: Options of the trials; an object or a k_cm among them takes the place of the thesis'.
        jobs: Trials at a time; above one they slow each other down, and so the times.
        config_dir: A user's folder of options.
        say: Told about the progress.

    Raises:
        ConfigurationError: An option cannot be used; nothing is run then.
    """
    store, options = ResultStore(output), SweepOptions(jobs=jobs)
    trials: list[SweepTrial] = []
    for cell in cells(overrides, config_dir):
        trials += plan_sweep(cell, store, options, config_dir)
    for count, result in enumerate(run_sweep(trials, store, options), 1):
        say(f"{count} {result.trial_id} {result.object.name} {result.status}")
    store.write_table()
    with published(output) as folder:
        rows, document = _write(trials, store, folder, say)
        names = sorted(path.name for path in folder.iterdir())
    shown = [{key: row[key] for key in _SHOWN} for row in rows]
    return PaperResult(shown, document, [output / name for name in names])


def cells(overrides: Sequence[str], config_dir: Path | None) -> list[list[str]]:
    """Return the grid's overrides: the thesis' objects or the one asked for; both k_cm unless one is.

    Raises:
        ConfigurationError: An option cannot be used.
    """
    named = any(override.startswith("object") for override in overrides)
    objects = [[]] if named else [[f"object={name}", f"hand.fingers={n}"] for name, n in OBJECTS.items()]
    option = centre_option(load_config([*_DEFAULTS, *objects[0], *overrides], config_dir).index_name)
    asked = any(override.startswith(f"index.{option}") for override in overrides)
    gains = [f"index.{option}=1,0"] if option and not asked else []
    return [[*_DEFAULTS, *chosen, *gains, *overrides] for chosen in objects]


def _write(
    trials: Sequence[SweepTrial], store: ResultStore, folder: Path, say: Say
) -> tuple[Rows, dict[str, Any]]:
    """Write tables, plot, and a picture of every cell that falls short."""
    from graspbench.report import style
    from graspbench.report.local_global import comparison_rows, local_global_table, summary  # loads pandas
    from graspbench.report.local_global_figures import draw_ratios  # loads Matplotlib
    from graspbench.report.tables import write_tables

    rows: Rows = []
    failed = []
    for trial in trials:
        result = store.result(trial.config.trial_id)
        if result is None or result.status != "done":
            failed.append(f"{_case(trial.config)}: {result.reason if result else 'was not run'}")
            continue
        found = comparison_rows(result)
        _explain(trial.config, result, found, folder, say)
        rows += found
    models = dict.fromkeys(trial.config.quality.describe() for trial in trials)
    notes = [settings_note(trials[0].config), *(f"Measures: {model}." for model in models), *failed]
    write_tables([local_global_table(rows, notes)], folder)
    write_atomically(folder / "short.md", _short_markdown(rows))
    if rows:
        with style.drawn_as(style.PRINT):
            draw_ratios(rows, folder / "ratios.png")
    document = {"rows": rows, "summary": summary(rows), "failed": failed, "settings": notes[0]}
    write_atomically(folder / "result.json", to_json({"schema": SCHEMA_VERSION, **document}))
    return rows, document


def settings_note(config: TrialConfig) -> str:
    """Say how a trial was planned and searched."""
    planner, search = config.local_planner, config.search
    return (
        f"Planner: {planner.planes} planes of {planner.rotations} first grasps, {planner.followers} of them "
        f"until the surface rests, the best by {planner.select}. "
        f"Search: at most {search.time_limit_s:g} s a measure; k_cm > 0: centre of grip within "
        f"{1e3 * search.centre_tolerance_m:g} mm of the centroid, or as far as the local grasp's."
    )


def _case(config: TrialConfig) -> str:
    gain = centre_gain(config.index_name, config.index)
    return f"{config.object.name}, {config.index_name if gain is None else f'k_cm = {gain:g}'}"


def _explain(config: TrialConfig, result: TrialResult, rows: Rows, folder: Path, say: Say) -> None:
    """Say why a row falls short, and draw its grasps; None in the others."""
    from graspbench.report import style
    from graspbench.report.local_global import is_short, reason
    from graspbench.report.local_global_figures import draw_grasps

    for row in rows:
        row["reason"] = row["picture"] = None
    short = [row for row in rows if is_short(row)]
    if not short:
        return
    say(f"{_case(config)}: drawing {len(short)} cells that fall short")
    surface = reconstructed(config)[-1]
    span_m = GraspChecker(load_hand(config.hand)).pair_limit_m
    for row in short:
        measure = row["measure"].lower()
        row["reason"] = reason(row, result, span_m)
        gain = "" if row["k_cm"] is None else f"_k_cm_{row['k_cm']:g}"
        row["picture"] = f"short_{row['object']}{gain}_{measure}.png"
        grasps = {
            name: _grasp(found, surface)
            for name, found in (
                ("local", result.local),
                ("global", result.global_[measure]),
                ("refined", result.refined.get(measure)),
            )
            if found is not None
        }
        labels = {f"{name}: {row['measure']} = {row[name]:.3g}": grasp for name, grasp in grasps.items()}
        title = f"{_case(config)}, {row['measure']}: local / global {row['ratio']:.2f}"
        if row["thesis"] is not None:
            title += f" (thesis {row['thesis']:.2f})"
        with style.drawn_as(style.PRINT):
            draw_grasps(surface, labels, folder / row["picture"], title, row["reason"])


def _grasp(found: GraspResult, surface: Surface) -> Grasp:
    nodes = np.array([contact.vertex for contact in found.contacts])
    return Grasp(nodes, surface.points[nodes], surface.normals[nodes], surface.centroid, None)


def _short_markdown(rows: Rows) -> str:
    short = [row for row in rows if row["reason"]]
    lines = ["### Cells that fall short", ""]
    for row in short:
        gain = "" if row["k_cm"] is None else f", k_cm = {row['k_cm']:g}"
        lines += [f"- **{row['object']}{gain}, {row['measure']}**: {row['reason']}", ""]
        lines += [f"  ![its grasps]({row['picture']})", ""]
    return "\n".join(lines if short else [*lines, "None."]) + "\n"
