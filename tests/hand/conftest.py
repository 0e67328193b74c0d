from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from graspbench.experiment import load_config
from graspbench.hand import HandModel, load_hand


def read_hand(name: str, **changes: Any) -> HandModel:
    return load_hand(replace(load_config([f"hand={name}"]).hand, **changes))


@pytest.fixture(scope="session")
def hand_named() -> Callable[..., HandModel]:
    return read_hand


@pytest.fixture(scope="session")
def radial() -> HandModel:
    return read_hand("radial")


@pytest.fixture(scope="session")
def allegro() -> HandModel:
    return read_hand("allegro", fingers=4)


@pytest.fixture(params=["radial", "allegro", "allegro_left"])
def hand(request: pytest.FixtureRequest) -> HandModel:
    return read_hand(request.param, fingers=3)


def random_joints(hand: HandModel, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(hand.lower, hand.upper)
