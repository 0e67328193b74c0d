"""Mutated configurations, as strings and as trees: used, or refused in one sentence; never a traceback.

With GRASPBENCH_FUZZ=10000 in the environment so many of each are tried instead of a few.
"""

import copy
import os
import time

import numpy as np
import pytest

from graspbench.config.trial_config import (
    config_from_tree,
    load_any_config,
    load_config,
    load_manipulation_config,
    manipulation_config_from_tree,
)
from graspbench.config.values import flatten
from graspbench.errors import GraspbenchError

COUNT = int(os.environ.get("GRASPBENCH_FUZZ", "150"))

DEEP: list = []
for _ in range(2000):
    DEEP = [DEEP]
VALUES = [
    None, True, False, 0, -1, 1, 2**40, 10**5000, 0.0, -0.0, 1e-300, 1e300, float("nan"), float("inf"), "",
    "x", "auto", "null", "1", "0x1", "\ud800", "\x00", "a" * 100_000, "=cmd|x", "${oc.env:HOME}", "${a.b}",
    "../../x", "/proc/self/mem", "~nobody/x", b"bytes", b"\xff", [], [1], [[]], ["a", 1, None], {},
    {"x": 1}, {1: 2}, {None: 1}, {"name": "x"}, [float("nan")] * 5, (1, 2), {1, 2}, object(), DEEP,
    {"\ud800": 1}, {b"k": 1}, 1j,
]  # fmt: skip
KEYS = ["", "name", "seed", "clik", "tasks", "grids", "choice", "\ud800", "a.b", 1, None, b"k", "x" * 5000]
WORDS = [
    "", "null", "true", "0", "-1", "1e308", "1e-308", "nan", "inf", "[]", "[1,2]", "{}", "{a:1}", "a,b",
    "range(0,3)", "interval(0,1)", "glob(*)", "choice(a,b)", "sort(3,1)", "${oc.env:HOME}", "${seed}", "'",
    '"', "\\", "\n", "é", "\x00", "\ud800", "a" * 5000, "[" * 500, "(", "=", "@", ":", "int(1)",
    "json_str('1')", "99999999999999999999999",
]  # fmt: skip


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


@pytest.mark.parametrize("kind", ["trial", "manipulation"])
@pytest.mark.timeout(3600)
def test_mutated_trees_are_told_about_in_one_sentence(kind):
    rng = np.random.default_rng(8)
    first, load = {
        "trial": (load_config(), config_from_tree),
        "manipulation": (load_manipulation_config(), manipulation_config_from_tree),
    }[kind]
    tree = first.as_tree()
    used = sum(used_or_told(load, mutated_tree(tree, rng)) for _ in range(COUNT // 2))
    assert 0 < used < COUNT // 2


@pytest.mark.timeout(3600)
def test_mutated_overrides_are_told_about_in_one_sentence():
    rng = np.random.default_rng(9)
    keys = [key for key, _ in flatten(load_manipulation_config().as_tree())]
    used = 0
    for _ in range(COUNT):
        overrides = [mutated_override(keys, rng) for _ in range(rng.integers(1, 3))]
        primary = "manipulate" if rng.integers(2) else "config"
        used += used_or_told(load_any_config, overrides, None, primary)
    assert 0 < used < COUNT
