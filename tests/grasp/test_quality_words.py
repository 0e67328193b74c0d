"""What the model behind Q1 to Q3 is called in tables."""

import pytest

from graspbench.config.trial_config import load_config
from graspbench.grasp import QualityParameters
from graspbench.grasp.contact import CONTACT_MODELS
from graspbench.grasp.wrench import WRENCH_SPACES


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ("default", "hard fingers (friction 0.5, 8 cone edges), forces and moments in space"),
        (
            "thesis",
            "frictionless points, forces in the grasp's plane, moments and transversal forces neglected",
        ),
        ("planar", "hard fingers (friction 0.5, 8 cone edges), forces in the grasp's plane and the moment"),
    ],
)
def test_each_named_model_says_what_it_is(choice, words):
    assert words in load_config([f"quality={choice}"]).quality.describe()


def test_every_model_is_called_something_else():
    said = {
        QualityParameters(contact=contact, wrench_space=space, norm=norm).describe()
        for contact in CONTACT_MODELS
        for space in WRENCH_SPACES
        for norm in ("l1", "linf")
    }
    assert len(said) == len(CONTACT_MODELS) * len(WRENCH_SPACES) * 2
    assert QualityParameters(friction=0.3).describe() != QualityParameters().describe()
    assert "40 mm" in QualityParameters(torque_length=0.04).describe()
