"""The claim of the parallel planner in numbers: how good are grasps that are found while the surface forms?

Every object is photographed and reconstructed once; grasps are planned on the same surfaces with three and
four contacts, by the measure models ``thesis`` and ``default``, and once more without hand and ground. Under
``thesis`` no grasp whatever can be better than contacts whose normals lie in one plane at equal angles
(see `ceiling`), so what is set against that is never more than the ratio to the best grasp on the surface.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.bench.planner_plot import draw_planner_bench
from graspbench.bench.result import BenchResult
from graspbench.bench.timing import best_time
from graspbench.config.trial_config import TrialConfig, load_config
from graspbench.datasets import catalogue_files
from graspbench.errors import ConfigurationError, GraspbenchError
from graspbench.grasp.quality import GraspQuality
from graspbench.hand import GraspChecker, load_hand
from graspbench.planning import LocalPlan, make_index, plan_local
from graspbench.reconstruction import Surface
from graspbench.trial.planned import reconstructed

OBJECTS = ("bottle", "duck", "pear", "teddy")
ALL = "all"
CONTACTS = (3, 4)
CASES = (("thesis", True), ("default", True), ("thesis", False))
"""Measure model, and whether there is a hand."""

FORMED = np.linspace(0.0, 1.0, 11)
SHOWN = (
    "objects", "contacts", "quality", "hand", "ratio_mean", "ratio_p10", "followed_share", "formed_50",
    "formed_80", "formed_100", "planning_ms",
)  # fmt: skip

Rows = tuple[dict[str, object], ...]


@dataclass(frozen=True)
class Cell:
    """What became of one object, number of contacts, measure model, with or without a hand.

    Attributes:
        row: What is written of it.
        ratios: Q1 to Q3 over the ceiling, shape (3,); zeros where there is no grasp, None without a ceiling
            or a surface.
        formed: Mean of Q1 to Q3 over the final grasp's when the surface was formed to `FORMED`; None where
            there is no grasp.
    """

    row: Mapping[str, object]
    ratios: FloatArray | None = field(compare=False)
    formed: FloatArray | None = field(compare=False)


def run(
    output_dir: Path | None = None,
    *,
    objects: Sequence[str] = OBJECTS,
    random: int = 0,
    quick: bool = False,
) -> BenchResult:
    """Plan on every object; one that comes to no grasp, or cannot be reconstructed, has a row that says why.

    Args:
        output_dir: Where the plot goes; none is drawn without it.
        objects: Names in the catalogue; ``all`` for all of them.
        random: So many of the random objects of ``pybullet_data`` too, the first ones.
        quick: Take three contacts only.

    Raises:
        ConfigurationError: There is no object, or none of such a name.
    """
    catalogue = [name for name in catalogue_files() if name != "random"]
    names = catalogue if ALL in objects else list(objects)
    chosen = [(name, [f"object={name}"]) for name in names]
    chosen += [(f"random_{i:03d}", ["object=random", f"object.id={i}"]) for i in range(random)]
    if not chosen:
        raise ConfigurationError("there is no object to measure", remedy="name one, such as teddy")
    configs = [load_config(overrides) for _, overrides in chosen]  # all names are checked first
    cells: list[Cell] = []
    for (name, overrides), config in zip(chosen, configs, strict=True):
        cells += _of_object(name, overrides, config, CONTACTS[:1] if quick else CONTACTS)
    summary = _summary(cells)
    steps = _steps(cells)
    figures = () if output_dir is None else (draw_planner_bench(_curves(cells), steps, output_dir),)
    tables = {"objects": tuple(dict(cell.row) for cell in cells), "steps": steps}
    return BenchResult("planner", summary, figures, tables, SHOWN)


def ceiling(contacts: int) -> GraspQuality:
    """Return what no grasp can exceed with frictionless contacts and forces in the grasp's plane alone.

    The grasp matrix G has n columns in the plane, none longer than one. So the squares of its two singular
    values sum to n at most, and the largest ball in the hull of n such columns is the regular polygon's.

    Args:
        contacts: Their number n, at least 3.
    """
    return GraspQuality(
        float(np.sqrt(contacts / 2)), contacts / 2, float(np.cos(np.pi / contacts)) if contacts > 2 else 0.0
    )


def _of_object(
    name: str, overrides: Sequence[str], config: TrialConfig, contacts: Sequence[int]
) -> Iterator[Cell]:
    try:
        surfaces = reconstructed(config)
    except GraspbenchError as error:
        for n_f, (quality, hand) in product(contacts, CASES):
            yield _failed(_key(name, n_f, quality, hand), str(error), no_surface=True)
        return
    for n_f, (quality, hand) in product(contacts, CASES):
        key = _key(name, n_f, quality, hand)
        case = load_config([*overrides, f"hand.fingers={n_f}", f"quality={quality}"])
        try:
            time_s, plan = best_time(partial(_plan, case, surfaces, hand=hand), 1)
        except GraspbenchError as error:
            yield _failed(key, str(error))
            continue
        yield _cell(key, plan, time_s)


def _key(name: str, contacts: int, quality: str, hand: bool) -> dict[str, object]:
    objects = "random" if name.startswith("random_") else "catalogue"
    return {"object": name, "objects": objects, "contacts": contacts, "quality": quality, "hand": hand}


def _plan(config: TrialConfig, surfaces: Sequence[Surface], *, hand: bool) -> LocalPlan:
    n_f = config.hand.fingers
    checker = GraspChecker(load_hand(config.hand), 0.0 if config.surface.ground else None) if hand else None
    index = make_index(config.index_name, config.index, n_f, config.quality)
    return plan_local(iter(surfaces), index, checker, n_f, config.local_planner, config.quality)


def _failed(key: Mapping[str, object], why: str, *, no_surface: bool = False) -> Cell:
    row = dict.fromkeys((*(f"ratio_q{i}" for i in (1, 2, 3)), "q1", "q2", "q3", *_ROW), None)
    counts = key["quality"] == "thesis" and not no_surface
    return Cell({**key, **row, "no_surface": no_surface, "note": why}, np.zeros(3) if counts else None, None)


_ROW = ("found_by", "followed_share", "polish_mm", "formed_50", "formed_80", "formed_100", "planning_ms")


def _cell(key: Mapping[str, object], plan: LocalPlan, time_s: float) -> Cell:
    contacts = len(plan.grasp.vertices)
    final = np.array(plan.quality)
    ratios = final / np.array(ceiling(contacts)) if key["quality"] == "thesis" else None
    formed = np.array([np.mean(_quality_at(plan, share) / final) for share in FORMED])
    at = dict(zip(np.round(100 * FORMED).astype(int).tolist(), formed.tolist(), strict=True))
    shown = [None] * 3 if ratios is None else ratios.tolist()
    values = (plan.found_by, plan.followed_share, plan.polish_mm, at[50], at[80], at[100], 1e3 * time_s)
    row = {
        **{f"ratio_q{i}": value for i, value in enumerate(shown, start=1)},
        **plan.quality._asdict(),
        **dict(zip(_ROW, values, strict=True)),
        "no_surface": False,
        "note": "",
    }
    return Cell({**key, **row}, ratios, formed)


def _quality_at(plan: LocalPlan, share: float) -> FloatArray:
    """Return Q1 to Q3 of the best grasp at the first step that was formed so far, shape (3,)."""
    reached = [step for step in plan.steps if step.formed >= share - 1e-9]
    return np.array(reached[0].quality) if reached else np.zeros(3)


def _groups(cells: Sequence[Cell]) -> dict[tuple[object, ...], list[Cell]]:
    groups: dict[tuple[object, ...], list[Cell]] = {}
    for cell in cells:
        key = tuple(cell.row[name] for name in ("objects", "contacts", "quality", "hand"))
        groups.setdefault(key, []).append(cell)
    return groups


def _summary(cells: Sequence[Cell]) -> Rows:
    """Return one row a group: ratios over all surfaces and measures; those without a grasp count as zero."""
    rows = []
    for (objects, contacts, quality, hand), group in _groups(cells).items():
        known = [cell.ratios for cell in group if cell.ratios is not None]
        planned = [cell.row for cell in group if cell.formed is not None]
        rows.append(
            {
                "objects": objects,
                "contacts": contacts,
                "quality": quality,
                "hand": hand,
                "count": len(group),
                "without_surface": sum(bool(cell.row["no_surface"]) for cell in group),
                "without_grasp": sum(cell.formed is None and not cell.row["no_surface"] for cell in group),
                "restarts": sum(row["found_by"] == "restart" for row in planned),
                "ratio_mean": float(np.mean(known)) if known else None,
                "ratio_p10": float(np.quantile(known, 0.1)) if known else None,
                **{
                    name: float(np.mean([float(str(row[name])) for row in planned])) if planned else None
                    for name in _ROW[1:-1]
                },
                "planning_ms": float(np.median([float(str(row["planning_ms"])) for row in planned]))
                if planned
                else None,
            }
        )
    return tuple(rows)


def _steps(cells: Sequence[Cell]) -> Rows:
    """Return how good the best grasp was over how far the surface was formed, of groups with a hand."""
    rows = []
    for (objects, contacts, quality, hand), group in _groups(cells).items():
        formed = np.array([cell.formed for cell in group if cell.formed is not None]).reshape(-1, len(FORMED))
        if not hand or not len(formed):
            continue
        for k, share in enumerate(FORMED):
            rows.append(
                {
                    "objects": objects,
                    "contacts": contacts,
                    "quality": quality,
                    "formed": float(share),
                    "mean": float(formed[:, k].mean()),
                    "p10": float(np.quantile(formed[:, k], 0.1)),
                }
            )
    return tuple(rows)


def _curves(cells: Sequence[Cell]) -> dict[tuple[object, ...], FloatArray]:
    """Return all ratios to the ceiling in ascending order, by group."""
    return {
        key: np.sort(np.concatenate([np.empty(0), *(c.ratios for c in group if c.ratios is not None)]))
        for key, group in _groups(cells).items()
        if key[2] == "thesis"
    }
