"""The thesis' experiments, by name."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from graspbench.errors import ConfigurationError
from graspbench.paper.appendix_a import appendix_a
from graspbench.paper.figures_3 import figures_3
from graspbench.paper.paper_result import PaperResult, Say, published
from graspbench.paper.physical import physical
from graspbench.paper.quality_study import quality_study
from graspbench.paper.table_3_1 import table_3_1
from graspbench.results.plain import to_json
from graspbench.results.store import SCHEMA_VERSION, write_atomically

Experiment = Callable[[Path, Sequence[str], int, Path | None, Say], PaperResult]


def case_study(
    output: Path, overrides: Sequence[str], jobs: int, config_dir: Path | None, say: Say
) -> PaperResult:
    """Two planar grippers move a bar, with and without secondary tasks (section 4.5, figures 4.4 to 4.7)."""
    from graspbench.manipulation import run_case_study
    from graspbench.paper.case_study_log import record_case_study
    from graspbench.report import style
    from graspbench.report.case_study_figures import draw_case_study, write_histories

    if overrides:
        raise ConfigurationError(
            "the case study takes no overrides", remedy="use graspbench.manipulation.run_case_study"
        )
    results = {}
    for with_tasks in (True, False):
        name = "with_tasks" if with_tasks else "without_tasks"
        say(f"simulating the case study {name.replace('_', ' ')}")
        results[name] = run_case_study(with_tasks)
    say("drawing")
    document = {name: result.summary() for name, result in results.items()}
    with published(output) as folder:
        with style.drawn_as(style.PRINT):
            files = list(draw_case_study(list(results.values()), folder))
        files.append(write_histories(list(results.values()), folder / "histories.csv"))
        files += [record_case_study(result, folder / f"{name}.mcap") for name, result in results.items()]
        files.append(folder / "result.json")
        write_atomically(files[-1], to_json({"schema": SCHEMA_VERSION, **document}))
    rows = [{"case": name.replace("_", " "), **_shown(found)} for name, found in document.items()]
    return PaperResult(rows, document, [output / path.name for path in files])


def _shown(summary: dict[str, Any]) -> dict[str, Any]:
    keys = (
        "pose_error_max_m",
        "q3_max_rad",
        "distance_13_min_m",
        "midpoint_distance_after_first_pause_max_m",
        "closed_chain_residual_max_m",
    )
    return {key: summary[key] for key in keys}


EXPERIMENTS: dict[str, Experiment] = {
    "table-3.1": table_3_1,
    "figures-3": figures_3,
    "appendix-a": appendix_a,
    "case-study": case_study,
    "physical": physical,
    "quality-study": quality_study,
}
