"""What grasp quality measures are worth: do they foretell what a grasp withstands in physics?"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspbench.errors import ConfigurationError
from graspbench.paper.paper_result import PaperResult, Say, published
from graspbench.results.plain import to_json
from graspbench.results.store import SCHEMA_VERSION, write_atomically

if TYPE_CHECKING:
    from graspbench.paper.study.analysis import Analysis
    from graspbench.report.tables import Table

GRASPS_FILE = "grasps.parquet"

Rows = Sequence[dict[str, Any]]


def quality_study(
    output: Path,
    overrides: Sequence[str],
    jobs: int,
    config_dir: Path | None,
    say: Say,
    *,
    grasps: int = 0,
) -> PaperResult:
    """Say how well every measure foretells what grasps withstand; try further grasps first if asked for.

    Args:
        output: Folder of tables and figure; further grasps are kept there too.
        overrides: None are taken: the grasps that are kept were made with one setting.
        jobs: Objects at a time, when grasps are tried.
        config_dir: Not used.
        say: Told about the progress.
        grasps: Rows that the table shall have; 0 takes the table as it is.

    Raises:
        ConfigurationError: Overrides were given, or the table cannot be read.
    """
    from graspbench.paper.study.analysis import analyse  # loads pandas
    from graspbench.paper.study.table import KEPT, read_table
    from graspbench.report import style
    from graspbench.report.study_figure import draw_study
    from graspbench.report.tables import write_tables

    if overrides:
        raise ConfigurationError(
            "the study takes no overrides: its grasps were made with one setting",
            remedy="leave them out; --grasps N goes on with it",
        )
    own = output / GRASPS_FILE
    if grasps:
        from graspbench.paper.study.continuation import continued  # loads the simulation

        frame = continued(own, read_table(KEPT) if KEPT.is_file() else None, grasps, jobs, say)
    else:
        frame = read_table(own if own.is_file() else KEPT)
    say(f"analysing {len(frame)} grasps")
    found = analyse(frame)
    with published(output) as folder:
        write_tables([predictor_table(found), condition_table(found)], folder)
        with style.drawn_as(style.PRINT):
            draw_study(found.rows, folder / "quality_study.png")
        document = {"counts": dict(found.counts), "rows": found.rows, "conditions": found.conditions}
        write_atomically(folder / "result.json", to_json({"schema": SCHEMA_VERSION, **document}))
        names = sorted(path.name for path in folder.iterdir())
    shown = [
        {key: row[key] for key in ("predictor", "spearman", "spearman.low", "spearman.high", "auc")}
        for row in found.rows
    ]
    return PaperResult(shown, document, [output / name for name in names])


def predictor_table(found: "Analysis") -> "Table":
    """Return how well each predictor foretells, with intervals."""
    from graspbench.paper.study.analysis import FOLDS
    from graspbench.paper.study.outcomes import NEEDED_WEIGHT
    from graspbench.report.tables import Column, Table

    counts = found.counts
    return Table(
        "predictors",
        "What foretells that a grasp withstands",
        (
            Column("predictor", "predictor"),
            Column("spearman", "weakest force", format=".2f", group="Spearman", interval=_ends("spearman")),
            Column("torque", "weakest torque", format=".2f", group="Spearman", interval=_ends("torque")),
            Column("auc", "AUC", format=".2f", interval=_ends("auc")),
            Column("grasps", "grasps", format="d", narrow=False),
        ),
        found.rows,
        (
            f"{counts['grasps']} grasps of all qualities by {counts['hands']} hands on {counts['objects']} "
            f"objects, {counts['disturbances']} graded disturbances; {counts['held']} were held, "
            f"{counts['withstood']} withstood {NEEDED_WEIGHT:g} weight in every direction. 95 % intervals "
            "by bootstrap over objects.",
            f"Best single and combination: chosen and fitted on the other objects, {FOLDS} folds. Where less "
            "is better, the predictor's sign is turned.",
        ),
    )


def condition_table(found: "Analysis") -> "Table":
    """Return how much hand, friction and mass change what each predictor foretells."""
    from graspbench.report.tables import Column, Table

    parts = list(dict.fromkeys((row["condition"], row["value"]) for row in found.conditions))
    order = [row["predictor"] for row in found.rows]
    rows = []
    for name in order:
        own = {(r["condition"], r["value"]): r for r in found.conditions if r["predictor"] == name}
        if own:
            rows.append({"predictor": name} | {f"{k} {v}": own[k, v]["spearman"] for k, v in own})
    return Table(
        "conditions",
        "Spearman's rank correlation with the weakest force, by hand, friction and mass",
        (
            Column("predictor", "predictor"),
            *(Column(f"{key} {value}", value, format=".2f", group=_HEADS[key]) for key, value in parts),
        ),
        tuple(rows),
        ("Intervals and numbers of grasps are in the data.",),
        data=found.conditions,
    )


_HEADS = {"hand": "hand", "friction": "friction", "mass_kg": "mass, kg"}


def _ends(name: str) -> tuple[str, str]:
    return f"{name}.low", f"{name}.high"
