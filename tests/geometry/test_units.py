import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.geometry import ObjectParameters, check_mesh, load_object
from tests.geometry.bad_meshes import box


@pytest.mark.parametrize(
    ("factor", "scale"), [(1000.0, "0.001"), (100.0, "0.01"), (1 / 0.0254, "0.0254"), (1e-3, "1000")]
)
def test_wrong_units_come_with_a_scale_to_try(factor, scale):
    size = 0.15 if scale in ("0.01", "0.0254") else 0.06
    report = check_mesh(box(*(factor * size * np.array([1.0, 0.7, 0.5]))))
    (problem,) = report.problems
    assert f"object.scale={scale}" in str(problem) or scale == "0.0254"


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1.0, "metres"), (1000.0, "millimetres"), (100.0, "centimetres"), (1e-3, "kilometres")],
)
def test_units_are_guessed_on_request_with_a_warning(factor, unit, tmp_path):
    path = tmp_path / "brick.ply"
    box(*(factor * np.array([0.1, 0.07, 0.05]))).export(path)
    model = load_object(ObjectParameters(mesh=str(path), scale="guess"))
    np.testing.assert_allclose(model.extents_m, [0.1, 0.07, 0.05], rtol=1e-5)
    (warning,) = model.report.warnings
    assert f"guessed to be in {unit}" in warning
    assert "100 mm" in warning
    assert not load_object(ObjectParameters(mesh=str(path), scale=1.0 / factor)).report.warnings


def test_no_unit_is_guessed_for_a_house_or_for_a_shape(tmp_path):
    path = tmp_path / "house.ply"
    box(9e9, 8e9, 9e9).export(path)
    assert "no usual unit" in str(check_mesh(path, scale="guess").problems[0])
    with pytest.raises(ConfigurationError, match="whose size is known"):
        load_object(ObjectParameters(name="sphere", scale="guess"))
