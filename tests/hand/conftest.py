from collections.abc import Callable
from importlib import resources
from typing import Any

import numpy as np
import pytest
import yaml
from pydantic import TypeAdapter

from graspbench.hand import HandModel, HandParameters, load_hand

PARAMETERS = TypeAdapter(HandParameters)


def read_hand(name: str, **changes: Any) -> HandModel:
    text = (resources.files("graspbench.conf") / "hand" / f"{name}.yaml").read_text()
    return load_hand(PARAMETERS.validate_python(yaml.safe_load(text) | changes))


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
