"""How the held object answers a step of its goal and a step of a force on it."""

from collections.abc import Callable

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.simulation.bullet import pybullet
from graspbench.simulation.controllers.second_order import step_response
from graspbench.simulation.execution_result import StepOutcome
from graspbench.simulation.grip import Grip
from graspbench.simulation.stage import Stage

_UNIT_M = 1e-3
_SETTLE_S = 0.3
_RISEN = 1.0 - np.exp(-1.0)


def step_outcomes(stage: Stage, grip: Grip) -> dict[str, StepOutcome]:
    """Try the steps that ``execution`` asks for; afterwards everything is as before.

    What is left of the motion before is let die out first.
    """
    p, client = stage.parameters, stage.world.client
    outcomes: dict[str, StepOutcome] = {}
    if p.step_m == p.step_force_n == 0.0:
        return outcomes
    saved, memory = pybullet.saveState(physicsClientId=client), grip.control.memory()
    for _ in range(max(1, round(_SETTLE_S / stage.time_step_s))):
        grip.control.drive(grip.palm, 1.0, 1.0)
        pybullet.stepSimulation(physicsClientId=client)
    if p.step_m > 0.0:

        def displace(axis: FloatArray) -> None:
            grip.control.displace(p.step_m * axis)

        outcomes["goal"] = _outcome(stage, grip, displace, lambda _: None, (p.step_m, grip.control.model))
    if p.step_force_n > 0.0:
        model = grip.control.pushed_model

        def push(axis: FloatArray) -> None:
            pybullet.applyExternalForce(
                stage.world.object_id,
                -1,
                (p.step_force_n * grip.palm[:3, :3] @ axis).tolist(),
                stage.world.object_pose()[:3, 3].tolist(),
                pybullet.WORLD_FRAME,
                physicsClientId=stage.world.client,
            )

        unit_m = _UNIT_M if model is None else p.step_force_n / model[2]
        outcomes["force"] = _outcome(stage, grip, lambda _: None, push, (unit_m, model))
    pybullet.restoreState(stateId=saved, physicsClientId=client)
    pybullet.removeState(saved, physicsClientId=client)
    grip.control.recall(memory)
    return outcomes


def _outcome(
    stage: Stage,
    grip: Grip,
    begin: Callable[[FloatArray], None],
    go_on: Callable[[FloatArray], None],
    expected: tuple[float, tuple[float, float, float] | None],
) -> StepOutcome:
    unit_m, model = expected
    answers = np.stack([_answer(stage, grip, axis, begin, go_on) for axis in np.eye(3)]) / unit_m
    times = stage.time_step_s * np.arange(1, answers.shape[1] + 1)
    error = None
    if model is not None:
        away = answers - step_response(times, *model)
        error = float(np.sqrt((away**2).mean(axis=1)).max())
    ends = answers[:, -1]
    reached = answers >= _RISEN * ends[:, None]
    return StepOutcome(
        error=error,
        end=float(ends[np.argmax(np.abs(ends - 1.0))]),
        overshoot=float(((answers.max(axis=1) - ends) / np.maximum(np.abs(ends), 1e-9)).max()),
        rise_time_s=float(times[np.argmax(reached, axis=1)].max()),
    )


def _answer(
    stage: Stage,
    grip: Grip,
    axis: FloatArray,
    begin: Callable[[FloatArray], None],
    go_on: Callable[[FloatArray], None],
) -> FloatArray:
    """Return how far the object has moved along an axis of the palm at each time step, shape (t,), m."""
    client = stage.world.client
    saved, memory = pybullet.saveState(physicsClientId=client), grip.control.memory()
    start = grip.object_in_palm()
    begin(axis)
    moved = []
    for _ in range(max(1, round(stage.parameters.step_time_s / stage.time_step_s))):
        go_on(axis)
        grip.control.drive(grip.palm, 1.0, 1.0)
        pybullet.stepSimulation(physicsClientId=client)
        moved.append(float((grip.object_in_palm()[:3, 3] - start[:3, 3]) @ axis))
    pybullet.restoreState(stateId=saved, physicsClientId=client)
    pybullet.removeState(saved, physicsClientId=client)
    grip.control.recall(memory)
    return np.array(moved)
