"""Draw joints towards the postures of a demonstration."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.secondary_task import TASKS, SecondaryTask, TaskValue
from graspbench.manipulation.task_geometry import contact_motion

_POSITION = ("object_x_m", "object_y_m", "object_z_m")
_MAX_ROWS = 2000


@TASKS.register("demonstrated_posture")
@dataclass(frozen=True, kw_only=True)
class DemonstratedPosture(SecondaryTask):
    """Draw joints, as far as all else allows, towards what they were in a demonstration.

    A demonstration is a table of postures by the object's position in the palm, as ``histories.csv`` of an
    in-hand motion is. The posture wanted is the mean of the demonstrated ones, weighted by a normal
    distribution over the distance of the object's position from theirs (Nadaraya 1964); turns of the
    object do not count.
    """

    gain: Annotated[float, Field(ge=0, description="Gain K of the error, 1/s")] = 1.0
    file: Annotated[
        str | None,
        Field(
            description="CSV with object_x_m, object_y_m, object_z_m and a column NAME_rad for every joint"
        ),
    ] = None
    width_m: Annotated[
        float, Field(gt=0, description="Standard deviation of the weights over the object's position, m")
    ] = 0.003

    def evaluate(self, state: State) -> TaskValue | None:
        """Return a row for every joint; None without a demonstration."""
        if self.file is None:
            return None
        system, n_q = state.system, state.system.n_joints
        positions, postures = read_demonstration(str(Path(self.file).expanduser()))
        if postures.shape[1] != n_q:
            raise ConfigurationError(
                f"the demonstration {self.file} has {postures.shape[1]} joints but the hand {n_q}",
                remedy="give clik.tasks.demonstrated_posture.file of the same hand",
            )
        here = state.object_positions.mean(axis=0)
        away = (positions - here) / self.width_m
        squares = np.sum(away**2, axis=1)
        weights = np.exp(-0.5 * (squares - squares.min()))
        weights /= weights.sum()
        posture = weights @ postures
        by_position = (weights[:, None] * (postures - posture)).T @ away / self.width_m
        moved = np.zeros((3, system.n_variables))
        for i in range(system.n_contacts):
            motion = contact_motion(state, i)
            moved += (motion.tip - motion.lever) / system.n_contacts
        jacobian = np.eye(n_q, system.n_variables) - by_position @ moved
        error = posture - state.joints
        return TaskValue(-error, jacobian, error)


@lru_cache(maxsize=8)
def read_demonstration(path: str) -> tuple[FloatArray, FloatArray]:
    """Return the object's positions, shape (k, 3), m, and the joints there, shape (k, n_q), rad.

    Raises:
        ConfigurationError: The file cannot be read, lacks columns, or holds something else than numbers.
    """
    try:
        with open(path, encoding="utf-8") as file:
            names = file.readline().strip().split(",")
            joints = [k for k, name in enumerate(names) if name.endswith("_rad")]
            wanted = [names.index(name) for name in _POSITION] + joints
            table = np.loadtxt(file, delimiter=",", usecols=wanted, ndmin=2)
    except (OSError, ValueError) as error:
        raise ConfigurationError(
            f"the demonstration {path} cannot be used: {error}",
            remedy=f"give a CSV file with the columns {', '.join(_POSITION)} and NAME_rad for every joint",
        ) from error
    if not len(table) or not joints or not np.isfinite(table).all():
        raise ConfigurationError(
            f"the demonstration {path} has no posture or one that is not finite",
            remedy="give histories.csv of an in-hand motion",
        )
    table = table[:: max(1, -(-len(table) // _MAX_ROWS))]
    return table[:, :3], table[:, 3:]
