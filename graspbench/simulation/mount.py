"""What the hand is mounted on in an execution."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.hand.model import HandModel
from graspbench.simulation.execution import ExecutionParameters
from graspbench.simulation.mount_arm import ArmModel, brackets
from graspbench.simulation.mount_kuka import KukaArm
from graspbench.simulation.mount_placement import place_arm
from graspbench.simulation.palm_motion import carrying, shakes, tilt_axis
from graspbench.simulation.wrist import FloatingWrist, Mount

_KEY_POSES = 10


def make_mount(
    hand: HandModel,
    times_s: FloatArray,
    palms: FloatArray,
    object_position: FloatArray,
    parameters: ExecutionParameters,
) -> Mount:
    """Return the mount that the parameters name, at the start of a path.

    Args:
        hand: The hand.
        times_s: Times of the planned path, shape (t,).
        palms: Its transform_palm_to_world, shape (t, 4, 4).
        object_position: The object's centre of mass in the world, shape (3,).
        parameters: Mount and phases.

    Raises:
        SimulationError: The arm can do the task from no place beside the object.
    """
    if parameters.mount == "floating":
        return FloatingWrist(hand, palms[0], tilt_axis(palms[-1]))
    arms = [ArmModel(hand, bracket) for bracket in brackets(palms[-1])]
    tasks = {
        direction: _task(times_s, palms, object_position, parameters, direction) for direction in (1.0, -1.0)
    }
    return KukaArm(hand, place_arm(arms, tasks, object_position))


def _task(
    times_s: FloatArray,
    palms: FloatArray,
    object_position: FloatArray,
    p: ExecutionParameters,
    tilt_direction: float,
) -> tuple[FloatArray, list[float]]:
    """Return poses that the palm will pass on its path and after it, shape (n, 4, 4), and when."""
    chosen = np.unique(np.linspace(0, len(times_s) - 1, 2 * _KEY_POSES).astype(int))
    poses, times = [palms[k] for k in chosen], [float(times_s[k]) for k in chosen]
    if p.until in ("off", "contact"):
        return np.stack(poses), times
    phases = carrying(palms[-1], object_position, p, tilt_direction)
    if p.until == "shakes":
        phases += shakes(phases[-1][1](1.0), p)
    for name, motion, time_s in phases:
        start = times[-1]
        count = 4 * _KEY_POSES if name.startswith("shake") else _KEY_POSES
        for share in (np.arange(count) + 1.0) / count:
            poses.append(motion(float(share)))
            times.append(start + float(share) * time_s)
    return np.stack(poses), times
