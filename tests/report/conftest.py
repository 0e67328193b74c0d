from types import SimpleNamespace

import numpy as np
import pytest

from tests.made_up_trial import trial

__all__ = ["paths", "trial"]


@pytest.fixture
def paths(trial):
    share = np.linspace(1.0, 0.0, 20)[:, None]
    return [
        SimpleNamespace(
            via=point + normal * 0.02 + share[::5] * [0, 0, 0.03],
            approach=point + normal * 0.02 + share * [0, 0, 0.03],
            grasp=point + normal * 0.02 * share,
        )
        for point, normal in zip(trial.grasp.points, trial.grasp.normals, strict=True)
    ]
