"""Exploring grasps: a few candidates are felt with the whole hand, and the one that feels best is executed.

The local planner stops at one summit of its index. From its grasp the chosen measure is climbed to several
summits of the seen surface; Bayesian optimisation then says which grasp to feel next, starting with the one
that would be executed otherwise. It ends when the best felt measure is close enough to the certified upper
bound of the global search, if that was run, or when nothing better is expected.
"""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.config.trial_config import TrialConfig
from graspbench.errors import PlanningError
from graspbench.grasp.configuration import Grasp
from graspbench.grasp.measure import evaluate_measures
from graspbench.grasp.quality import GraspQuality
from graspbench.planning import (
    GlobalResult,
    PlanningProblem,
    clear_approach,
    make_index,
    placed_grasp,
    refine,
)
from graspbench.planning.grasp_optimization import GraspOptimization
from graspbench.reconstruction.surface import Surface
from graspbench.simulation.exploring_grasp import feel_grasp
from graspbench.simulation.tip_friction import tip_friction
from graspbench.simulation.touch_parameters import TouchParameters
from graspbench.simulation.world import World
from graspbench.trial.clock import StageClock
from graspbench.trial.planned import PlannedTrial, Scene
from graspbench.trial.strengthening import measured_on_surface

_SUMMITS = 4
"""Climbs, each with jumps of its own."""

_BESIDE = 6
"""Grasps beside each summit that the hand holds, too."""

_NO_GAIN = 0.01
"""Share of the best felt measure; if less is expected to be won, feeling ends."""


@dataclass(frozen=True, eq=False)
class Explored:
    """What exploring grasps felt.

    Attributes:
        grasp: The one that felt best.
        history: Configurations that lead to it, the grasp last.
        quality: Its Q1, Q2 and Q3 on the seen surface.
        measure: What was optimised.
        felt: The measure at the contacts felt, of each grasp in their order; 0 where a finger met nothing
            or no way leads there.
        foreseen: The same on the seen surface.
        best: Number of the best.
        candidates: Grasps that were chosen from.
        bound: Certified upper bound on the seen surface; None without a search.
        ended: Why it ended: ``enough``, ``number``, ``no gain`` or ``no candidate``.
        moved_mm: By how much the object was moved by it all: the truth, which the hand does not know.
        time_s: Simulated time that it took.
    """

    grasp: Grasp
    history: tuple[Grasp, ...]
    quality: GraspQuality
    measure: str
    felt: tuple[float, ...]
    foreseen: tuple[float, ...]
    best: int
    candidates: int
    bound: float | None
    ended: str
    moved_mm: float
    time_s: float


def explored(
    config: TrialConfig, trial: PlannedTrial, best: Mapping[str, GlobalResult], clock: StageClock
) -> PlannedTrial:
    """Feel some grasps, if that is asked for, and put the one that felt best in place of the planned one.

    Args:
        config: What to run.
        trial: Up to its plan.
        best: Results of the global search by measure, for their bounds.
        clock: Times the stages.
    """
    wanted = config.execution.touch.max_grasps and config.execution.until != "off"
    if not wanted or trial.scene is None or trial.executed.grasp.posture is None:
        return trial
    p, scene = config.execution.touch, trial.scene
    bound = best[p.measure].upper_bound if p.measure in best else None
    candidates = clock.run("exploring_candidates", lambda: _candidates(config, trial, p.measure))
    found = clock.run("exploring", lambda: _explore(config, trial, scene, candidates, bound))
    return trial if found is None else replace(trial, explored=found)


def _explore(
    config: TrialConfig, trial: PlannedTrial, scene: Scene, candidates: list[Grasp], bound: float | None
) -> Explored | None:
    """Feel one candidate after the other; None where none gave a force closure grasp."""
    p, surface = config.execution.touch, trial.surfaces[-1]
    foreseen = _foreseen(config, surface, np.stack([grasp.vertices for grasp in candidates]))
    belief = _belief(p, surface, candidates, foreseen)
    before, spent_s, number, ended = scene.world.object_pose(), 0.0, 0, "number"
    felt = belief.felt
    while True:
        value, time_s = _felt(config, trial, scene, candidates[number])
        spent_s += time_s
        belief.tell(number, value)
        top = max(felt.values())
        if bound is not None and top >= p.enough_share * bound:
            ended = "enough"
            break
        if len(felt) >= p.max_grasps:
            break
        choice = belief.choose()
        if choice is None or choice.improvement < _NO_GAIN * top:
            ended = "no candidate" if choice is None else "no gain"
            break
        number = choice.number
    if top <= 0.0:
        return None
    order = list(felt)
    number = max(order, key=lambda k: felt[k])
    grasp, now = candidates[number], scene.world.object_pose()
    return Explored(
        grasp=grasp,
        history=trial.executed.history if number == 0 else (grasp,),
        quality=measured_on_surface(config, trial, grasp),
        measure=p.measure,
        felt=tuple(felt.values()),
        foreseen=tuple(float(foreseen[k]) for k in order),
        best=order.index(number),
        candidates=len(candidates),
        bound=bound,
        ended=ended,
        moved_mm=1e3 * float(np.linalg.norm(now[:3, 3] - before[:3, 3])),
        time_s=spent_s,
    )


def _belief(
    p: TouchParameters, surface: Surface, candidates: list[Grasp], foreseen: FloatArray
) -> GraspOptimization:
    contacts = np.stack([_by_finger(grasp) for grasp in candidates])
    size_m = float(np.ptp(surface.points, axis=0).max())
    deviation = p.measure_std * float(foreseen.max())
    return GraspOptimization(contacts, foreseen, deviation, 0.3 * deviation, 0.25 * size_m)


def _by_finger(grasp: Grasp) -> FloatArray:
    assert grasp.posture is not None
    ordered: FloatArray = grasp.points[np.argsort(grasp.posture.fingers)]
    return ordered


def _felt(config: TrialConfig, trial: PlannedTrial, scene: Scene, grasp: Grasp) -> tuple[float, float]:
    """Return the measure at the contacts that a grasp feels, and the time; nothing where no way leads to it.

    The hand feels in a world of its own, in which the object stands where it stood last; how the hand gets
    from one grasp to the next, clear of the object, is left out.
    """
    surface, execution = trial.surfaces[-1], config.execution
    history = trial.executed.history if grasp is trial.executed.grasp else (grasp,)
    try:
        _, motion = clear_approach(
            history, surface, trial.hand, config.planner, trial.checker.ground_height_m
        )
    except PlanningError:
        return 0.0, 0.0
    friction = tip_friction(execution, config.quality, surface)
    with World(scene.model, config.scene, config.seed) as world:
        world.put_object(scene.world.object_pose())
        found = feel_grasp(world, trial.hand, grasp, motion, motion.closing, execution, friction)
        scene.world.put_object(world.object_pose())
    if found.contacts is None:
        return 0.0, found.time_s
    points, inward = found.contacts[:, 0], found.contacts[:, 1]
    return float(_measured(config, surface, points, inward)), found.time_s


def _foreseen(config: TrialConfig, surface: Surface, vertices: IntArray) -> FloatArray:
    """Return the measure of grasps on the seen surface, vertices of shape (m, n_f)."""
    return _measured(config, surface, surface.points[vertices], -surface.normals[vertices])


def _measured(config: TrialConfig, surface: Surface, points: FloatArray, inward: FloatArray) -> FloatArray:
    name, length_m = config.execution.touch.measure, _length_m(config, surface)
    values = evaluate_measures((name,), points, inward, surface.centroid, config.quality, length_m)
    return np.maximum(values[name], 0.0)


def _length_m(config: TrialConfig, surface: Surface) -> float:
    return config.quality.torque_length_m(surface.points, surface.centroid)


def _candidates(config: TrialConfig, trial: PlannedTrial, measure: str) -> list[Grasp]:
    """Return grasps that the hand holds: the one to be executed first, then summits and some beside them."""
    found = {_key(grasp): grasp for grasp in (trial.executed.grasp, trial.plan.grasp)}
    for seed in range(_SUMMITS):
        parameters = replace(config.planner.refine, seed=config.planner.refine.seed + seed)
        with suppress(PlanningError):
            climbed = refine(
                trial.plan.grasp, trial.surfaces[-1], measure, config.quality, checker=trial.checker,
                parameters=parameters,
            )  # fmt: skip
            found.setdefault(_key(climbed.grasp), climbed.grasp)
    for summit in list(found.values()):
        for grasp in _beside(config, trial, summit):
            found.setdefault(_key(grasp), grasp)
    return list(found.values())


def _key(grasp: Grasp) -> tuple[int, ...]:
    return tuple(sorted(int(v) for v in grasp.vertices))


def _beside(config: TrialConfig, trial: PlannedTrial, summit: Grasp) -> Iterator[Grasp]:
    """Yield the best few grasps with one contact of a grasp moved to a node of its contour."""
    surface = trial.surfaces[-1]
    problem = PlanningProblem(
        trial.surfaces, trial.checker, len(summit.vertices),
        make_index(config.index_name, config.index, config.hand.fingers, config.quality),
        config.quality, config.seed, config.planner.time_limit_s,
    )  # fmt: skip
    moved = np.array(
        [
            [*summit.vertices[:i], other, *summit.vertices[i + 1 :]]
            for i, node in enumerate(summit.vertices)
            for other in surface.network.contour(int(node))
            if other not in summit.vertices
        ]
    )
    if not len(moved):
        return
    values = _foreseen(config, surface, moved)
    left = _BESIDE
    for k in np.argsort(values)[::-1]:
        if left == 0 or values[k] <= 0.0:
            return
        grasp = placed_grasp(problem, surface, moved[k], summit.posture)
        if grasp is not None:
            left -= 1
            yield grasp
