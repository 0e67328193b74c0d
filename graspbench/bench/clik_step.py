"""One CLIK step of an Allegro hand with four contacts and three secondary tasks, against its peer.

The peer is Pink's inverse kinematics of the four fingertips with joint limits; it has no object, no
contact variables and no priorities, so it is given the smaller problem.
"""

import gc
import math
import time
from collections.abc import Callable, Iterable
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml
from pydantic import TypeAdapter

from graspbench.arrays import FloatArray
from graspbench.bench.result import BenchResult
from graspbench.errors import ConfigurationError, ManipulationError
from graspbench.hand import HandModel, HandParameters, load_hand
from graspbench.manipulation import charts
from graspbench.manipulation.clik import Clik, ClikParameters
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem
from graspbench.manipulation.integration import INTEGRATORS, step
from graspbench.manipulation.loop import simulate
from graspbench.manipulation.manipulate import hand_tree
from graspbench.manipulation.motion import MotionParameters, object_motion
from graspbench.manipulation.secondary_task import build_tasks

Method = Literal["pseudo_inverse", "transpose"]

SECONDARY_TASKS = {
    "joint_limit": {"priority": 0, "margin": 0.4, "start_s": -9.0},
    "fingertip_distance": {
        "priority": 1, "first": 1, "second": 2, "minimum_m": 0.02, "threshold_m": 0.08, "start_s": -9.0,
    },
    "joint_centring": {"priority": 2, "gain": 0.5, "start_s": -9.0},
}  # fmt: skip


def run(output_dir: Path | None = None, *, repeats: int = 3000, peer: bool = True) -> BenchResult:
    """Measure the step, all its variants, the peer, and the stability of the loop.

    Args:
        output_dir: Not used; there is no plot.
        repeats: Steps measured a row.
        peer: Also measure pin-pink.

    Raises:
        ConfigurationError: The peer is asked for and not installed.
    """
    hand = allegro()
    rows: list[dict[str, object]] = []
    for label, parameters, tasks in (
        ("pseudo_inverse, 3 tasks", ClikParameters(integrator="euler"), SECONDARY_TASKS),
        ("pseudo_inverse, no task", ClikParameters(integrator="euler"), {}),
        ("transpose, no task", ClikParameters(method="transpose", integrator="euler"), {}),
        ("qp, 3 tasks", ClikParameters(method="qp", integrator="euler"), SECONDARY_TASKS),
    ):
        case = allegro_case(hand, parameters, tasks)
        times = _time(partial(_step, *case), repeats)
        rows.append(_row("graspbench", label, times, case[0].system.n_variables))
    if peer:
        times = _time(pink_step(hand), max(repeats // 3, 1))
        rows.append(_row("pin-pink", "four fingertips, joint limits", times, hand.n_joints))
        for row in rows:
            row["speedup_vs_pink"] = float(np.median(times)) * 1e6 / float(str(row["median_us"]))
    return BenchResult("clik", tuple(rows), tables={"stability": stability()})


def allegro() -> HandModel:
    """Return the Allegro hand with all four fingers."""
    text = (files("graspbench.conf") / "hand" / "allegro.yaml").read_text(encoding="utf-8")
    values: dict[str, Any] = yaml.safe_load(text)
    return load_hand(TypeAdapter(HandParameters).validate_python({**values, "fingers": 4}))


def allegro_case(
    hand: HandModel, parameters: ClikParameters, tasks: dict[str, dict[str, Any]]
) -> tuple[Clik, FloatArray, FloatArray]:
    """Return the law, joints and contact variables: the hand holds a 60 mm ball with hard contacts."""
    centre = np.array([0.030, 0.0, 0.085])
    away = np.array([[-1.0, -0.3, 0.2], [0.7, -0.9, 0.1], [1.0, 0.0, 0.3], [0.7, 0.9, 0.1]])
    away /= np.linalg.norm(away, axis=1)[:, None]
    reach = 0.030 + hand.tip_radius_m
    by_finger = [
        hand.finger_ik(f, centre + reach * away[f], hand.preferred[hand.finger_joints(f)]).joints[0]
        for f in range(4)
    ]
    joints = hand.joint_vector(np.array(by_finger))
    tips = hand.tip_positions(joints)
    # the ball's surface is where the tips are, each on a sphere chart about the ball's centre
    contacts = []
    for tip in tips:
        offset = tip - centre
        radius = float(np.linalg.norm(offset)) - hand.tip_radius_m
        contacts.append(Contact(charts.sphere(radius, towards=offset), "hard", hand.tip_radius_m))
    system, variables = ManipulationSystem(hand_tree(hand, range(4)), contacts).grasped(
        joints, centre, np.eye(3)
    )
    motion = object_motion(MotionParameters(), centre, np.eye(3))
    return Clik(system, motion, parameters, build_tasks(tasks)), joints, variables


def stability(
    gains: Iterable[float] = (10.0, 100.0, 500.0, 900.0, 1900.0, 2200.0),
    steps_s: Iterable[float] = (1e-3, 2e-3, 4e-3),
    *,
    methods: Iterable[Method] = ("pseudo_inverse", "transpose"),
    periods: int = 400,
) -> tuple[dict[str, object], ...]:
    """Sweep gain and period of Euler's loop that starts off its pose.

    The pseudo-inverse multiplies the error by 1 - K dt in every period: it needs K dt < 2. The transpose
    multiplies its part along each singular vector of the extended Jacobian by about 1 - K dt s^2: the largest
    singular value s bounds the gain, and the smallest decides how slow it is.

    Returns:
        A row for each method, period and gain: gain_times_step, error_start and error_end (largest of the
        fingers, m and rad), and stable: whether the error has fallen.
    """
    rows: list[dict[str, object]] = []
    case, joints, variables = allegro_case(allegro(), ClikParameters(), {})
    start = case.reference(0.0)
    offset = start._replace(position=start.position + 5e-4)
    first = float(np.sqrt(3.0) * 5e-4)
    for method in methods:
        for period in steps_s:
            for gain in gains:
                options = ClikParameters(
                    method=method, integrator="euler", gain=gain, rotation_gain=gain, step_s=period
                )
                law = Clik(case.system, lambda _: offset, options)
                try:
                    history = simulate(law, joints, variables, periods * period)
                    errors = np.linalg.norm(history.pose_errors, axis=2).max(axis=1)
                    last = float(errors[-1])
                except ManipulationError:  # it has left all bounds
                    last = math.inf
                rows.append(
                    {
                        "method": method,
                        "step_s": period,
                        "gain": gain,
                        "gain_times_step": gain * period,
                        "error_start": first,
                        "error_end": last,
                        "stable": bool(last < first),
                    }
                )
    return tuple(rows)


def pink_step(hand: HandModel) -> Callable[[], object]:
    """Return one step of Pink's inverse kinematics for the four fingertips.

    Raises:
        ConfigurationError: pin-pink is not installed.
    """
    try:
        import pink
        from pink.limits import ConfigurationLimit, VelocityLimit
        from pink.tasks import FrameTask
    except ImportError:
        raise ConfigurationError(
            "the benchmark's peer pin-pink is not installed", remedy="pip install graspbench[bench]"
        ) from None
    model, data = hand.model, hand.model.createData()
    configuration = pink.Configuration(model, data, hand.preferred.copy())
    tasks = [FrameTask(name, position_cost=1.0, orientation_cost=0.0) for name in hand.tip_links]
    for task in tasks:
        task.set_target_from_configuration(configuration)
        task.transform_target_to_world.translation += 0.001
    limits = [ConfigurationLimit(model), VelocityLimit(model)]

    def once() -> object:
        configuration.update(hand.preferred)
        return pink.solve_ik(configuration, tasks, 1e-3, solver="proxqp", limits=limits)

    return once


def _step(law: Clik, joints: FloatArray, variables: FloatArray) -> object:
    velocity = law.velocity(1.0, joints, variables)
    return step(law, INTEGRATORS["euler"], 1.0, 1e-3, joints, variables, velocity, None)


def _time(once: Callable[[], object], repeats: int) -> FloatArray:
    for _ in range(20):
        once()
    times = np.zeros(repeats)
    was = gc.isenabled()
    gc.disable()
    try:
        for k in range(repeats):
            start = time.perf_counter()
            once()
            times[k] = time.perf_counter() - start
    finally:
        if was:
            gc.enable()
    return times


def _row(library: str, case: str, times: FloatArray, variables: int) -> dict[str, object]:
    return {
        "library": library,
        "case": case,
        "variables": variables,
        "median_us": float(np.median(times)) * 1e6,
        "best_us": float(times.min()) * 1e6,
        "p95_us": float(np.percentile(times, 95)) * 1e6,
    }
