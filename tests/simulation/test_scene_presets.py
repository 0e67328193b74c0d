from dataclasses import asdict
from importlib.resources import files

import pytest
import yaml
from pydantic import TypeAdapter

from graspbench.perception import CameraParameters, SilhouetteParameters, StationParameters
from graspbench.simulation.execution_parameters import ExecutionParameters
from graspbench.simulation.scene import SceneParameters

GROUPS = {
    "scene": (SceneParameters, "default"),
    "camera": (CameraParameters, "default"),
    "stations": (StationParameters, "thesis"),
    "silhouette": (SilhouetteParameters, "default"),
    "execution": (ExecutionParameters, "default"),
}
CHOICES = [
    pytest.param(group, path, id=f"{group}-{path.name}")
    for group in GROUPS
    for path in sorted(files("graspbench.conf").joinpath(group).iterdir(), key=lambda path: path.name)
    if path.name.endswith(".yaml")
]


@pytest.mark.parametrize(("group", "path"), CHOICES)
def test_every_choice_fits_its_parameters(group, path):
    kind, default = GROUPS[group]
    content = yaml.safe_load(path.read_text())
    if "defaults" in content:
        assert content.pop("defaults") == [default, "_self_"]
    assert set(content) <= {field for field in asdict(kind())}
    TypeAdapter(kind).validate_python(content)


@pytest.mark.parametrize("group", GROUPS)
def test_the_default_choice_is_what_the_code_says(group):
    kind, default = GROUPS[group]
    content = yaml.safe_load(files("graspbench.conf").joinpath(group, f"{default}.yaml").read_text())
    assert TypeAdapter(kind).validate_python(content) == kind()
