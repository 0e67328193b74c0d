"""Mutated configurations, as strings and as trees: used, or refused in one sentence; never a traceback.

With GRASPBENCH_FUZZ=10000 in the environment so many of each are tried instead of a few.
"""

import copy
import time

import numpy as np
import pytest

from graspbench.config.engine import load_engine, split_engine
from graspbench.config.grid import MAX_TRIALS, expand_sweep
from graspbench.config.trial_config import (
    config_from_tree,
    kind_of,
    load_any_config,
    load_config,
    load_manipulation_config,
    manipulation_config_from_tree,
)
from graspbench.config.values import flatten
from graspbench.errors import GraspbenchError
from graspbench.sweep.tune import axis_overrides, split_axes
from tests.fuzz import Budget

BUDGET = Budget(150)
COUNT = BUDGET.count

DEEP: list = []
for _ in range(2000):
    DEEP = [DEEP]
VALUES = [
    None, True, False, 0, -1, 1, 2**40, 2**64, 10**5000, 0.0, -0.0, 1e-300, 1e300, float("nan"), float("inf"),
    "", "x", "auto", "null", "1", "0x1", "\ud800", "\x00", "a" * 100_000, "=cmd|x", "${oc.env:HOME}",
    "${a.b}", "../../x", "/proc/self/mem", "~nobody/x", b"bytes", b"\xff", [], [1], [[]], ["a", 1, None], {},
    {"x": 1}, {1: 2}, {None: 1}, {"name": "x"}, [float("nan")] * 5, (1, 2), {1, 2}, object(), DEEP,
    {"\ud800": 1}, {b"k": 1}, 1j,
]  # fmt: skip
KEYS = [
    10**5000,
    "",
    "name",
    "seed",
    "clik",
    "tasks",
    "grids",
    "choice",
    "\ud800",
    "a.b",
    1,
    None,
    b"k",
    "x" * 5000,
]
WORDS = [
    "", "null", "true", "0", "-1", "1e308", "1e-308", "nan", "inf", "[]", "[1,2]", "{}", "{a:1}", "a,b",
    "range(0,3)", "interval(0,1)", "glob(*)", "choice(a,b)", "sort(3,1)", "${oc.env:HOME}", "${seed}", "'",
    '"', "\\", "\n", "é", "\x00", "\ud800", "a" * 5000, "[" * 500, "(", "=", "@", ":", "int(1)",
    "json_str('1')", "99999999999999999999999", "9" * 5000, "[" * 5000, "{a:" * 3000, "1," * 9000 + "1",
]  # fmt: skip
GRIDS = [
    "1,2", "range(0,inf)", "range(0,10,0)", "range(0,10,0.0)", "range(0,1e9)", "range(nan,1)", "range(3)",
    "range(3,0,-1)", "range(0,1,1e-300)", "range(0,1" + "0" * 400 + ")", "interval(0,1)", "interval(1,0)",
    "int(interval(0,1e300))", "tag(log,interval(0,1))", "interval(0,inf)", "shuffle(range(0,3))", "glob(*)",
    "glob(x)", "choice()", "choice(a,[b,c])", "sort(choice(3,1))", "shuffle(1,2)", "glob([d*,t*],exclude=x)",
]  # fmt: skip
ENGINE = [f"engine{key}" for key in ("", ".jobs", ".silence_s", ".partition", ".name", ".cluster", ".x")]


def used_or_told(load, *arguments):
    """Return whether a configuration is used; what is said against it must be one short line."""
    start = time.process_time()
    try:
        load(*arguments).trial_id  # noqa: B018
    except GraspbenchError as error:
        text = str(error)
        assert "\n" not in text
        assert len(text) < 2600, text[:300]
        text.encode()
        return False
    finally:
        assert time.process_time() - start < 60.0
    return True


def nodes(tree):
    """Return every mapping of a tree with its keys."""
    found, waiting = [], [tree]
    while waiting:
        node = waiting.pop()
        found += [(node, key) for key in node]
        waiting += [child for child in node.values() if isinstance(child, dict)]
    return found


def mutated_tree(tree, rng):
    """Return a tree with a few values, keys or sections replaced, added, swapped or dropped."""
    broken = copy.deepcopy(tree)
    for _ in range(rng.integers(1, 4)):
        places = nodes(broken)
        if not places:
            break
        node, key = places[rng.integers(len(places))]
        match rng.integers(0, 6):
            case 0 | 1 | 2:
                node[key] = VALUES[rng.integers(len(VALUES))]
            case 3:
                del node[key]
            case 4:
                node[KEYS[rng.integers(len(KEYS))]] = VALUES[rng.integers(len(VALUES))]
            case 5:
                other, name = places[rng.integers(len(places))]
                node[key] = copy.deepcopy(other[name]) if other is not node else name
    return broken


def mutated_override(keys, rng):
    key = keys[rng.integers(len(keys))]
    word = WORDS[rng.integers(len(WORDS))]
    match rng.integers(0, 6):
        case 0 | 1 | 2:
            return f"{key}={word}"
        case 3:
            return f"{rng.choice(['+', '~', '++', ''])}{key}{rng.choice(['=', '', '@', ':='])}{word}"
        case 4:
            at = int(rng.integers(0, len(key)))
            return f"{key[:at]}{word}{key[at:]}={WORDS[rng.integers(len(WORDS))]}"
        case _:
            return f"{key.split('.')[0]}={word}"


def first_of_grid(overrides):
    """Return the first trial of a sweep, after all that is done before any is run."""
    engine, grid = split_engine(overrides)
    load_engine(engine)
    primary = kind_of(grid)
    cells = expand_sweep(grid, primary=primary)
    assert 0 < len(cells) <= MAX_TRIALS
    return load_any_config(cells[0], primary=primary)


def first_of_search(overrides):
    """Return the first trial of a search."""
    axes, grid = split_axes(overrides)
    return first_of_grid([*grid, *axis_overrides(axes, {axis.key: axis.low for axis in axes})])


@pytest.mark.parametrize("kind", ["trial", "manipulation"])
@BUDGET.timeout
def test_mutated_trees_are_told_about_in_one_sentence(kind):
    rng = np.random.default_rng(8)
    first, load = {
        "trial": (load_config(), config_from_tree),
        "manipulation": (load_manipulation_config(), manipulation_config_from_tree),
    }[kind]
    tree = first.as_tree()
    used = 0
    for k in range(COUNT // 2):
        with BUDGET.case(k):
            used += used_or_told(load, mutated_tree(tree, rng))
    assert 0 < used < COUNT // 2
    BUDGET.check()


@BUDGET.timeout
def test_mutated_overrides_are_told_about_in_one_sentence():
    rng = np.random.default_rng(9)
    keys = [key for key, _ in flatten(load_manipulation_config().as_tree())]
    used = 0
    for _ in range(COUNT):
        overrides = [mutated_override(keys, rng) for _ in range(rng.integers(1, 3))]
        primary = "manipulate" if rng.integers(2) else "config"
        with BUDGET.case(ascii(overrides)[:300]):
            used += used_or_told(load_any_config, overrides, None, primary)
    assert 0 < used < COUNT
    BUDGET.check()


@pytest.mark.parametrize(
    ("first", "plain"), [(first_of_grid, "seed=0,1"), (first_of_search, "index.k_e=interval(0.1,1)")]
)
@BUDGET.timeout
def test_mutated_grids_are_told_about_in_one_sentence(first, plain):
    assert used_or_told(first, [plain]) == 1
    rng = np.random.default_rng(10)
    keys = [key for key, _ in flatten(load_config().as_tree())]
    used = 0
    for _ in range(COUNT // 2):
        overrides = [mutated_override(keys, rng) for _ in range(rng.integers(0, 2))]
        chosen = rng.choice(["seed", "index.k_e", "object", "object.id", *keys, *ENGINE], rng.integers(1, 3))
        overrides += [f"{key}={GRIDS[rng.integers(len(GRIDS))]}" for key in chosen]
        with BUDGET.case(ascii(overrides)[:300]):
            used += used_or_told(first, overrides)
    assert used < COUNT // 2
    BUDGET.check()
