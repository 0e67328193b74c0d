"""The case study's motion as an MCAP log."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.record import TrialLog

if TYPE_CHECKING:
    from graspbench.manipulation import CaseStudyResult

_RATE_HZ = 25.0


def record_case_study(result: "CaseStudyResult", path: Path) -> Path:
    """Log joints, grippers, bar and the figures that decide, readable by ``graspbench log``.

    Args:
        result: One simulation.
        path: The MCAP file to write.
    """
    history = result.history
    every = max(round(1.0 / (_RATE_HZ * result.parameters.clik.step_s)), 1)
    kept = np.arange(0, len(history.times), every)
    bar = np.tile(np.eye(4), (len(kept), 1, 1))
    bar[:, :3, :3] = history.object_rotations[kept, 0]
    bar[:, :3, 3] = history.object_positions[kept].mean(axis=1)
    names = [f"gripper_{gripper}_joint_{k}" for gripper in "ab" for k in range(1, 8)]
    with TrialLog(path) as log:
        log.message("case study " + ("with tasks" if result.with_tasks else "without tasks"))
        log.joints(
            names,
            history.times[kept],
            history.joints[kept],
            skeletons=_skeletons(result, kept),
            transform_object_to_world=bar,
        )
        log.scores(result.summary())
    return path


def _skeletons(result: "CaseStudyResult", kept: IntArray) -> FloatArray:
    """Return the points along each branch from the base to its tip, shape (t, 4, 6, 3)."""
    from graspbench.manipulation.case_study import case_study_system

    system, _, _ = case_study_system(result.parameters)
    branches = [np.flatnonzero(path) for path in system.arrays.paths]
    history = result.history
    points = np.empty((len(kept), len(branches), len(branches[0]) + 1, 3))
    state = system.state(history.joints[0], history.contact_variables[0])
    for row, k in enumerate(kept):
        state.update(history.joints[k], history.contact_variables[k])
        for i, joints in enumerate(branches):
            points[row, i, :-1], points[row, i, -1] = state.joint_origins[joints], state.tip_positions[i]
    return points
