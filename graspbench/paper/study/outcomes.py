"""What the study calls a good grasp: read off the disturbances alone."""

import numpy as np
import pandas as pd

from graspbench.arrays import BoolArray, FloatArray
from graspbench.paper.study.predictors import SMALLER_IS_BETTER, predictor_names

NEEDED_WEIGHT = 1.0
"""A grasp withstands when it resists a force of its object's weight, on top of that, in every direction."""


def weakest_force(frame: pd.DataFrame) -> FloatArray:
    """Return the force resisted in the weakest direction, multiples of the weight, shape (n,)."""
    return np.array([np.min(each) for each in frame["forces_weight"]], dtype=np.float64)


def weakest_torque(frame: pd.DataFrame) -> FloatArray:
    """Return the torque resisted about the weakest axis, multiples of weight times lever, shape (n,)."""
    return np.array([np.min(each) for each in frame["torques_weight"]], dtype=np.float64)


def withstands(frame: pd.DataFrame) -> BoolArray:
    """Tell which grasps withstand; see `NEEDED_WEIGHT`, shape (n,)."""
    return np.asarray(weakest_force(frame) >= NEEDED_WEIGHT)


def predictor_columns(frame: pd.DataFrame) -> dict[str, FloatArray]:
    """Return every predictor, turned so that larger is better, by name; those that are constant left out."""
    found = {}
    for name in predictor_names():
        if name not in frame:
            continue
        values = pd.to_numeric(frame[name], errors="coerce").to_numpy(dtype=np.float64)
        if np.nanstd(values) > 0.0:
            found[name] = -values if name in SMALLER_IS_BETTER else values
    return found
