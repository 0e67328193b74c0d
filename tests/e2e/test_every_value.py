"""Each documented value of each option is run once: none may end in an error of the program's own."""

import itertools
import types
import typing
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, Literal, Union

import pandas as pd
import pytest
import yaml

from graspbench.config.schema import MANIPULATION_SECTIONS, SECTIONS, section_type
from graspbench.config.trial_config import load_config
from graspbench.grasp.measure import MEASURES
from graspbench.planning.index import INDICES
from graspbench.reconstruction.methods import METHODS
from tests.small import SHORT_EXECUTION, SMALL_PICTURES

COARSE = (
    "surface.meridians=14", "surface.parallels=13", *SMALL_PICTURES, "search.time_limit_s=0.05",
    "object=sphere", "planner.planes=3", "planner.candidates=2", "planner.refine.jumps=1",
    "record.level=scores", "record.pictures=false", *SHORT_EXECUTION,
)  # fmt: skip

# Chosen by a group whose other options they need, or by what the machine has; each has tests of its own.
ELSEWHERE = {"object.scale", "hand.kind", "hand.tip_shape", "scene.source", "scene.renderer", "clik.method",
    "record.video"}  # fmt: skip
# Values that may leave nothing to grasp by, or that take long: each in a trial of its own, so that it hides
# no other, and that no other waits for it.
ALONE = {
    "quality.contact", "quality.wrench_space", "quality.norm", "search.measures", "record.print",
    "record.pictures", "scene.motion", "surface.dynamics",
}  # fmt: skip
# What shows in a trial only together with something else; pictures take longer than all the rest.
WITH = {
    "record.print": ["record.pictures=true", 'execution="off"'],
    "record.pictures": ['execution="off"'],
    "surface.dynamics": ["surface.max_iterations=200"],  # on so few nodes not all of them come to rest
}
# Options whose values are words that a registry or a function knows.
WORDS = {
    "scene.table": ("plain", "checker", "wood", "speckle"),
    "surface.method": tuple(METHODS.names()),
    "quality.measures": tuple(
        f"[{','.join(names)}]" for names in (MEASURES.names()[::2], MEASURES.names()[1::2])
    ),
}


def values_of(hint: Any) -> tuple[Any, ...]:
    """Return the values that a type enumerates."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if hint is bool:
        return (True, False)
    if origin is Literal:
        return arguments
    if origin is typing.Annotated:
        return values_of(arguments[0])
    if origin is tuple:
        return tuple(f"[{value}]" for value in values_of(arguments[0]))
    if origin in (Union, types.UnionType):
        return tuple(itertools.chain.from_iterable(values_of(item) for item in arguments))
    return ()


def enumerated(kind: Any, prefix: str) -> Iterator[tuple[str, tuple[Any, ...]]]:
    hints = typing.get_type_hints(kind, include_extras=True)
    for field in fields(kind):
        key, hint = f"{prefix}.{field.name}", hints[field.name]
        inner = typing.get_args(hint)[0] if typing.get_origin(hint) is typing.Annotated else hint
        if is_dataclass(inner):
            yield from enumerated(inner, key)
        elif found := WORDS.get(key) or values_of(hint):
            yield key, found


def grids_of(options: dict[str, tuple[Any, ...]]) -> list[list[str]]:
    """Return sets of overrides in which every value stands at least once."""
    together = {key: values for key, values in options.items() if key not in ALONE}
    longest = max((len(values) for values in together.values()), default=0)
    grids = [
        [f"{key}={_word(values[i % len(values)])}" for key, values in together.items()]
        for i in range(longest)
    ]
    # They say what is planned: beyond the touch the physics is that of all trials.
    touch = ["execution.until=contact"] if "execution.until" in options else []
    alone = [
        # Options of recording are no part of a trial's identity: the seed tells their trials apart.
        [f"{key}={_word(value)}", *([*WITH[key], f"seed={seed}"] if key in WITH else touch)]
        for key in sorted(ALONE & set(options))
        for seed, value in enumerate(options[key], 1)
    ]
    return [*grids, *alone]


def _word(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else f'"{value}"' if value == "off" else str(value)


def _run(cli: Any, tmp_path: Any, grids: list[list[str]], *more: str) -> pd.DataFrame:
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "values.yaml").write_text(yaml.safe_dump({"grids": grids}))
    folder = tmp_path / "r"
    finished = cli("sweep", "experiment=values", "--config-dir", tmp_path, *more, "--jobs", 0, "-o", folder)
    assert finished.code in (0, 1), finished.stderr
    table = pd.read_csv(folder / "trials.csv")
    unexpected = table[table["reason"].astype(str).str.contains("unexpected")]
    assert unexpected.empty, unexpected[["trial_id", "reason"]].to_string()
    return table


def test_every_value_of_a_trial(cli, tmp_path):
    options = {key: values for s in SECTIONS for key, values in enumerated(section_type(s, {}), s)}
    options = {key: values for key, values in options.items() if key not in ELSEWHERE}
    assert {"scene.table", "surface.method", "planner.select", "execution.until"} <= set(options)
    grids = [[*COARSE, *grid] for grid in grids_of(options)]
    grids = [[*dict((text.partition("=")[0], text) for text in grid).values()] for grid in grids]
    table = _run(cli, tmp_path, grids)
    assert set(table["trial_id"]) == {load_config(grid).trial_id for grid in grids}
    assert (table["status"] == "done").mean() > 0.85, table[["status", "reason"]].to_string()


@pytest.mark.parametrize("name", INDICES.names())
def test_every_value_of_an_index(cli, tmp_path, name):
    options = dict(enumerated(section_type("index", {"name": name}), "index"))
    grids = grids_of(options) or [[]]
    grids = [[f"index={name}", *COARSE, *grid] for grid in grids]
    table = _run(cli, tmp_path, grids,
                 "search.enabled=false", 'execution="off"')  # fmt: skip
    assert (table["status"] == "done").all(), table["reason"].tolist()


def test_every_value_of_a_motion_in_the_hand(cli, tmp_path):
    options = {
        key: values
        for section in MANIPULATION_SECTIONS
        for key, values in enumerated(section_type(section, {}), section)
        if key not in ELSEWHERE
    }
    assert {"clik.integrator", "contact.kind", "motion.there_and_back"} <= set(options)
    grids = [[*COARSE, "motion=translate", "motion.duration_s=0.3", *grid] for grid in grids_of(options)]
    table = _run(cli, tmp_path, grids)
    assert set(table["kind"]) == {"manipulation"}
    assert (table["status"] == "done").any(), table["reason"].tolist()
