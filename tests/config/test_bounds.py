"""What validates ends: every number is bounded, and so are the products that are the cost."""

import re
from typing import Any

import numpy as np
import pytest

from graspbench.config.bounds import bounds_of, fields_of, is_whole
from graspbench.config.cost import MAX_MEMORY_GB, MAX_SECONDS, costs
from graspbench.config.schema import MANIPULATION_SECTIONS, SECTIONS, section_type
from graspbench.config.trial_config import load_any_config
from graspbench.errors import ConfigurationError
from graspbench.planning.index import INDICES
from tests.fuzz import Budget

BUDGET = Budget(40)


def numbers(kind: Any, prefix: str):
    """Yield the key, name, type and description of every option that is one number."""
    for name, hint, info in fields_of(kind):
        if hasattr(hint, "__dataclass_fields__"):
            yield from numbers(hint, f"{prefix}.{name}")
        elif {int, float} & {hint, *getattr(hint, "__args__", ())}:
            yield f"{prefix}.{name}", name, hint, info


TRIAL = [row for section in SECTIONS for row in numbers(section_type(section, {}), section)]
MOTION = [row for section in MANIPULATION_SECTIONS for row in numbers(section_type(section, {}), section)]
INDEX = [row for name in INDICES.names() for row in numbers(section_type("index", {"name": name}), name)]


def refused(override, *more):
    primary = "manipulate" if override.split(".")[0] in MANIPULATION_SECTIONS else "config"
    with pytest.raises(ConfigurationError) as caught:
        load_any_config([override, *more], primary=primary)
    assert len(str(caught.value)) < 600
    return str(caught.value)


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("camera.fx=1e12", "camera.fx"),
        ("surface.meridians=100000", "at most 100000"),
        ("surface.meridians=10000000000", "surface.meridians"),
        ("execution.time_step_s=1e-7", r"execution\.time_step_s\) would take about \S+ steps, .*GB"),
        ("execution.lift_time_s=1e6", "execution.lift_time_s"),
        ("execution.closing_speed_m_s=1e-300", "at least 1e-06"),
        ("scene.shadow_blur_m=1e9", "scene.shadow_blur_m"),
        ("camera.fx=nan", "camera.fx"),
        ("stations.outer.radius_m=inf", "from -100 to 100"),
        ("seed=1000000000000000000000", "seed"),
        ("scene.table_pattern_m=1e-9", "table_pattern_m"),
        ("surface.max_iterations=1000000", "surface.max_iterations"),
        ("clik.step_s=1e-6", "the motion"),
        ("planner.paths.time_step_s=1e-6", "fingertips' paths"),
    ],
)  # fmt: skip
def test_values_that_would_never_end_are_refused(override, said):
    more = ["motion.duration_s=3600"] if override.startswith("clik") else []
    if override == "surface.meridians=100000":
        more = ["surface.parallels=100"]
    if override.startswith("surface.max"):
        more = ["surface.nodes=100000"]
    message = refused(override, *more)

    assert re.search(said, message), message


def test_a_product_is_refused_where_its_factors_are_not():
    big = ["camera.width=4096", "camera.height=4096", "scene.supersampling=4", "stations.outer.count=200"]
    for factor in big[:3]:
        load_any_config([factor])
    message = refused(*big)
    assert "GB" in message
    assert "the images (camera.width" in message


@pytest.mark.parametrize("far", [1e300, -1e300, float("inf"), float("nan"), 1e-300])
def test_no_number_is_unbounded(far):
    for key, _, hint, _ in [*TRIAL, *MOTION]:
        if is_whole(hint) and far != 1e300:
            continue
        word = f"{int(far)}" if is_whole(hint) else f"{far!r}"
        if far == 1e-300 and not (key.endswith(("_s", "_m", "_kg", "_hz", "_n"))):
            continue
        if key == "object.id":
            continue
        assert key.split(".")[0] in refused(f"{key}={word}")


@BUDGET.timeout
def test_what_is_allowed_is_within_the_limits_of_time_and_memory():
    """Random values of any magnitude: what validates is estimated below the limits."""
    rng = np.random.default_rng(6)
    accepted = 0
    for _ in range(BUDGET.count):
        chosen = rng.choice(len(TRIAL), size=4, replace=False)
        words = []
        for k in chosen:
            key, name, hint, info = TRIAL[k]
            bounds = bounds_of(name, is_whole(hint), info)
            value = min(bounds.high, 10.0 ** rng.uniform(-9, 9))
            words.append(f"{key}={round(value) if is_whole(hint) else value}")
        try:
            config = load_any_config(words)
        except ConfigurationError as error:
            assert len(str(error)) < 600  # noqa: PT017
            continue
        accepted += 1
        for cost in costs(vars(config)):
            assert cost.gigabytes <= MAX_MEMORY_GB
            assert cost.seconds <= MAX_SECONDS
    assert accepted


def test_a_long_trial_says_so_first():
    assert load_any_config([]).warning is None
    assert "the execution" in load_any_config(["execution.hold_time_s=300"]).warning


def test_every_index_has_bounds():
    assert INDEX
    for _, name, hint, info in INDEX:
        assert np.isfinite(bounds_of(name, is_whole(hint), info).high)
