"""Table 3.1 without the hand, or without the ground: where these, not the planner, are the limit."""

import dataclasses
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeAlias

from graspbench.config.trial_config import TrialConfig, load_config
from graspbench.errors import ConfigurationError
from graspbench.grasp.distance import contact_distance_m
from graspbench.hand import GraspChecker, load_hand
from graspbench.paper.paper_result import PaperResult, Say, published
from graspbench.paper.table_3_1 import cells, settings_note
from graspbench.planning import centre_gain, make_index, plan_global, plan_local, plan_restarted, refine
from graspbench.results.plain import to_json
from graspbench.results.store import SCHEMA_VERSION, write_atomically
from graspbench.trial.planned import centre_tolerance_m, reconstructed

Without: TypeAlias = Literal["hand", "ground"]

_WORDS = {
    "hand": "Without a hand: contacts anywhere on the surface, for the planner and for the search.",
    "ground": "Without the ground: the hand may reach below the table, for the planner and for the search; "
    "the images and the surface are the same.",
}
_SHOWN = ("object", "k_cm", "measure", "ratio", "thesis", "met", "ratio_restarted", "ratio_refined", "gap")

Rows = list[dict[str, Any]]


def table_3_1_without(
    output: Path, overrides: Sequence[str], jobs: int, config_dir: Path | None, say: Say, *, without: Without
) -> PaperResult:
    """Compare local and global grasps as in table 3.1, with a constraint taken away from both.

    Nothing is stored but the tables: a grasp that no hand holds is no trial.

    Args:
        output: Folder of the tables.
        overrides: Options of the trials; an object or a k_cm among them takes the place of the thesis'.
        jobs: Not used.
        config_dir: A user's folder of options.
        say: Told about the progress.
        without: What is taken away; without a hand there is no ground either.

    Raises:
        ConfigurationError: An option cannot be used; nothing is run then.
        TrialError: A trial ends without a grasp.
    """
    from graspbench.report.local_global import local_global_table  # loads pandas
    from graspbench.report.tables import write_tables

    configs = list(_configs(overrides, config_dir))
    rows: Rows = []
    for config in configs:
        say(f"{config.object.name}: without the {without}")
        rows += _rows(config, without)
    notes = [
        _WORDS[without],
        settings_note(configs[0]),
        *(f"Measures: {model}." for model in dict.fromkeys(config.quality.describe() for config in configs)),
    ]
    with published(output) as folder:
        write_tables([local_global_table(rows, notes)], folder)
        document = {"without": without, "rows": rows, "notes": notes}
        write_atomically(folder / "result.json", to_json({"schema": SCHEMA_VERSION, **document}))
        names = sorted(path.name for path in folder.iterdir())
    shown = [{key: row[key] for key in _SHOWN} for row in rows]
    return PaperResult(shown, document, [output / name for name in names])


def _configs(overrides: Sequence[str], config_dir: Path | None) -> Iterator[TrialConfig]:
    """Yield each trial's configuration; of the grid's options only k_cm may have several values."""
    for cell in cells(overrides, config_dir):
        several = [
            override for override in cell if override.startswith("index.") and override.endswith("=1,0")
        ]
        if not several:
            yield load_config(cell, config_dir)
            continue
        rest = [option for option in cell if option not in several]
        for gain in (1, 0):
            yield load_config([*rest, several[0].replace("1,0", str(gain))], config_dir)


def _rows(config: TrialConfig, without: Without) -> Rows:
    """Plan and search one object, and set its grasps side by side."""
    from graspbench.report.local_global import compared

    n_f, quality, planner = config.hand.fingers, config.quality, config.local_planner
    surfaces = reconstructed(config)
    surface = surfaces[-1]

    def checker() -> GraspChecker | None:
        return None if without == "hand" else GraspChecker(load_hand(config.hand), None)

    plan = partial(make_index, config.index_name, config.index, n_f, quality)
    local = plan_local(surfaces, plan(), checker(), n_f, planner, quality)
    restarted = (
        plan_restarted(surfaces, plan(), checker(), n_f, planner, quality) if planner.restart else None
    )
    grasps = [local.grasp] if restarted is None else [local.grasp, restarted.grasp]
    tolerance = centre_tolerance_m(config, grasps)
    held = checker()
    if held is not None:
        held.set_object(surface.points, surface.network.faces)
    rows: Rows = []
    for measure in config.search.measures:
        if measure == "mirtich_canny":
            raise ConfigurationError(
                "table 3.1 compares Q1, Q2 and Q3", remedy="leave mirtich_canny out of search.measures"
            )
        refined = None
        if config.search.refine:
            refined = refine(
                local.grasp, surface, measure, quality,
                checker=held, centre_tolerance_m=tolerance, parameters=planner.refine,
            )  # fmt: skip
        found = plan_global(
            surface, measure, n_f, quality, config.search,
            checker=held, centre_tolerance_m=tolerance,
            starts=[*grasps, *([] if refined is None else [refined.grasp])],
        )  # fmt: skip
        row = compared(
            {
                "object": config.object.name,
                "fingers": n_f,
                "k_cm": centre_gain(config.index_name, config.index),
            },
            config.index_name,
            measure,
            {
                "local": getattr(local.quality, measure),
                "restarted": None if restarted is None else getattr(restarted.quality, measure),
                "refined": None if refined is None else refined.value,
            },
            {
                "global": found.value if found.grasp is not None else None,
                "upper_bound": found.upper_bound,
                "gap": found.gap,
                "optimal": found.optimal,
            },
            dataclasses.asdict(quality),
        )
        row["without"] = without
        row["distance_mm"] = (
            None if found.grasp is None else 1e3 * contact_distance_m(local.grasp.points, found.grasp.points)
        )
        rows.append(row)
    return rows
