"""What a trial costs, roughly: a product of options that would never end is refused with its estimate.

The figures per unit were measured on one core of a present-day machine; they are meant to tell minutes from
days, no more.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from graspbench.errors import ConfigurationError
from graspbench.reconstruction.parameters import MAX_NODES

MAX_MEMORY_GB = 4.0
MAX_SECONDS = 3600.0
SOON_SECONDS = 120.0

# Rendering a sample of an image, reading a pixel of a view, a step of physics, of the inverse kinematics, a
# sample of the fingertips' paths, a node of the surface with all that is planned on it.
_S_PER_RENDERED_SAMPLE = 8e-8
_S_PER_PIXEL = 1e-7
_S_PER_PHYSICS_STEP = 1.5e-3
_S_PER_BELT_STEP = 2e-4
_EXPLORING_GRASP_S = 4.0  # of simulated time, closing beyond the contacts aside
_BELT_STEP_S = 1.0 / 480.0
_WIDE_VIEWS = 6
_S_PER_ITERATION = 6e-6  # of the solver, in one physics step
_S_PER_CONTROL_STEP = 1e-4
_S_PER_PATH_SAMPLE = 5e-4
_S_PER_NODE = 2.5e-4
_S_PER_NODE_STEP = 1.7e-6
_S_PER_DRAW = 2e-5
_BYTES_PER_RENDERED_SAMPLE = 60.0
_BYTES_PER_PIXEL = 40.0
_BYTES_PER_PHYSICS_STEP = 150.0
_BYTES_PER_CONTROL_STEP = 2000.0
_BYTES_PER_PATH_SAMPLE = 2000.0
_BYTES_PER_NODE = 4_000.0
_WAY_M = 0.5  # of a fingertip on its path
_GIB = 2.0**30


@dataclass(frozen=True)
class Cost:
    """What a part of a trial costs.

    Attributes:
        what: The part, with the options whose product it is.
        count: Nodes, pixels, steps.
        unit: Which of them.
        seconds: Estimated processor time.
        gigabytes: Estimated memory.
    """

    what: str
    count: float
    unit: str
    seconds: float
    gigabytes: float

    def __str__(self) -> str:
        return f"about {_rounded(self.count)} {self.unit}, {_time(self.seconds)} and {self.gigabytes:.1f} GB"


def costs(parts: Mapping[str, Any]) -> tuple[Cost, ...]:
    """Estimate the parts of a trial; the global search is left out, as it keeps ``search.time_limit_s``.

    Args:
        parts: The validated parameters by section.
    """
    found = [_images(parts), _surface(parts), _paths(parts), _execution(parts)]
    if parts["scene"].motion != "none":
        found.append(_travel(parts))
    if "clik" in parts:
        steps = parts["motion"].duration_s / parts["clik"].step_s
        what = "the motion (motion.duration_s by clik.step_s)"
        found.append(_cost(what, steps, "steps", _S_PER_CONTROL_STEP, _BYTES_PER_CONTROL_STEP))
    return tuple(found)


def check_cost(parts: Mapping[str, Any]) -> None:
    """Refuse a trial of which a part would need more memory or time than any trial should.

    Raises:
        ConfigurationError: The sentence says which options, and what is estimated.
    """
    surface = parts["surface"]
    nodes = (surface.meridians or 3) * (surface.parallels or 1) + 2
    if nodes > MAX_NODES:
        raise ConfigurationError(
            f"surface.meridians by surface.parallels make at least {_rounded(nodes)} nodes",
            remedy=f"a surface has at most {MAX_NODES}",
        )
    for cost in (*costs(parts), *_at_worst(parts)):
        if cost.gigabytes > MAX_MEMORY_GB or cost.seconds > MAX_SECONDS:
            raise ConfigurationError(
                f"{cost.what} would take {cost}",
                remedy=f"no part of a trial may take more than {MAX_MEMORY_GB:g} GB or {_time(MAX_SECONDS)}",
            )


def warning(parts: Mapping[str, Any]) -> str | None:
    """Say before it begins that a trial will take long; None when it will not."""
    found = costs(parts)
    longest = max(found, key=lambda cost: cost.seconds)
    if sum(cost.seconds for cost in found) < SOON_SECONDS:
        return None
    return f"this takes long: {longest.what} alone {longest}"


def _at_worst(parts: Mapping[str, Any]) -> tuple[Cost, ...]:
    """Estimate what ends much earlier as a rule, but need not."""
    surface, refine = parts["surface"], parts["planner"].refine
    steps = _surface(parts).count * surface.max_iterations
    draws = float(refine.draws * (refine.jumps + 1))
    return (
        _cost("the surface (surface.nodes by surface.max_iterations)", steps, "steps", _S_PER_NODE_STEP, 0.0),
        _cost("the refinement (planner.refine.draws by jumps)", draws, "draws", _S_PER_DRAW, 0.0),
    )


def _images(parts: Mapping[str, Any]) -> Cost:
    camera, stations, scene = parts["camera"], parts["stations"], parts["scene"]
    views = 2 + stations.outer.count + stations.inner.count
    pixels = camera.width * camera.height * views
    samples = pixels * scene.supersampling**2
    seconds = samples * _S_PER_RENDERED_SAMPLE + pixels * _S_PER_PIXEL
    memory = samples / views * _BYTES_PER_RENDERED_SAMPLE + pixels * _BYTES_PER_PIXEL
    what = "the images (camera.width by camera.height by stations by scene.supersampling squared)"
    return Cost(what, samples, "pixels", seconds, memory / _GIB)


def _surface(parts: Mapping[str, Any]) -> Cost:
    surface = parts["surface"]
    across = surface.meridians or math.sqrt(surface.nodes)
    nodes = across * surface.parallels if surface.parallels else max(surface.nodes, across)
    return _cost("the surface (surface.nodes)", nodes, "nodes", _S_PER_NODE, _BYTES_PER_NODE)


def _paths(parts: Mapping[str, Any]) -> Cost:
    paths = parts["planner"].paths
    retreat = paths.retreat_m + parts["planner"].floating_distance_m
    seconds = (_WAY_M + retreat) / paths.tip_speed_m_s + paths.closing_time_s
    what = "the fingertips' paths (planner.paths.tip_speed_m_s, closing_time_s, retreat_m by time_step_s)"
    return _cost(what, seconds / paths.time_step_s, "samples", _S_PER_PATH_SAMPLE, _BYTES_PER_PATH_SAMPLE)


def _execution(parts: Mapping[str, Any]) -> Cost:
    p = parts["execution"]
    seconds = 0.0
    if p.until != "off":
        seconds = p.closing_distance_m / p.closing_speed_m_s
    if p.until not in ("off", "contact"):
        seconds += p.squeeze_time_s + p.lift_time_s + 2 * p.hold_time_s + p.rotation_time_s
    pushed = 12 if p.twist_limit_nm > 0.0 else 6
    seconds += pushed * p.push_time_s if p.until == "pushes" else 0.0
    seconds += 3 * p.shake_time_s if p.until == "shakes" else 0.0
    if p.until != "off" and p.touch.max_touches:
        seconds += p.touch.max_touches * (2e-3 * p.touch.reach_mm / p.touch.speed_m_s + 0.5)
    if p.until != "off":
        seconds += p.touch.max_grasps * (_EXPLORING_GRASP_S + p.closing_distance_m / p.closing_speed_m_s)
    each = _S_PER_PHYSICS_STEP + _S_PER_ITERATION * p.solver_iterations
    what = "the execution (its times by execution.time_step_s)"
    return _cost(what, seconds / p.time_step_s, "steps", each, _BYTES_PER_PHYSICS_STEP)


def _travel(parts: Mapping[str, Any]) -> Cost:
    stations, travel = parts["stations"], parts["scene"].travel
    images = _WIDE_VIEWS + 1 + stations.outer.count + stations.inner.count
    steps = (images * travel.image_period_s + travel.planning_time_s) / _BELT_STEP_S
    what = "the motion of the object (images by scene.travel.image_period_s, planning_time_s)"
    return _cost(what, steps, "steps", _S_PER_BELT_STEP, 0.0)


def _cost(what: str, count: float, unit: str, seconds_each: float, bytes_each: float) -> Cost:
    return Cost(what, count, unit, count * seconds_each, count * bytes_each / _GIB)


def _rounded(count: float) -> str:
    return f"{count:.0f}" if count < 1e6 else f"{count:.1e}"


def _time(seconds: float) -> str:
    if seconds < 2 * SOON_SECONDS:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 48 * 3600 else f"{seconds / 86400:.0f} days"
