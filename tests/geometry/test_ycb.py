"""The YCB set in the user's own folder: names, masses, sweeps. The meshes here are stand-ins."""

import pytest
import trimesh

from graspbench.config.trial_config import load_config
from graspbench.errors import ConfigurationError
from graspbench.experiment import expand_sweep
from graspbench.geometry import ObjectParameters, load_object, object_name
from graspbench.geometry.ycb import short_name, ycb_facts


@pytest.fixture
def folder(tmp_path):
    for name in ("mug", "065-d_cups", "something_else"):
        (tmp_path / "set" / name).mkdir(parents=True)
        trimesh.creation.box((0.05, 0.06, 0.07)).export(tmp_path / "set" / name / "textured.obj")
    return tmp_path / "set"


@pytest.mark.parametrize(
    ("name", "short"),
    [
        ("025_mug", "mug"),
        ("mug", "mug"),
        ("065-d_cups", "d_cups"),
        ("d_cups", "d_cups"),
        ("4_cups", "4_cups"),
    ],
)
def test_numbers_are_no_part_of_a_name(name, short):
    assert short_name(name) == short


def test_masses_are_those_of_the_paper():
    assert ycb_facts("003_cracker_box").mass_kg == 0.411
    assert ycb_facts("d_cups").mass_kg == 0.019
    assert ycb_facts("a_marbles").mass_kg is None
    assert "CC BY 4.0" in ycb_facts("mug").licence


def test_objects_of_the_set_have_their_true_mass(folder):
    config = load_config(["object=ycb", f"object.folder={folder}", "object.id=mug"])
    model = load_object(config.object)
    assert (model.name, model.mass_kg, model.friction) == ("mug", 0.118, 0.5)
    assert "CC BY 4.0" in model.licence
    assert (
        load_object(load_config(["object=ycb", f"object.folder={folder}", "object.id=d_cups"]).object).mass_kg
        == 0.019
    )
    given = load_config(["object=ycb", f"object.folder={folder}", "object.id=mug", "object.mass_kg=0.3"])
    assert load_object(given.object).mass_kg == 0.3
    dense = load_config(
        ["object=ycb", f"object.folder={folder}", "object.id=mug", "object.density_kg_m3=100"]
    )
    assert load_object(dense.object).mass_kg == pytest.approx(100 * 0.05 * 0.06 * 0.07)


def test_an_object_without_a_known_mass_says_so(folder):
    model = load_object(ObjectParameters(name="ycb", folder=str(folder), id="something_else"))
    assert model.mass_kg == pytest.approx(250 * 0.05 * 0.06 * 0.07)
    assert any("is in no table" in warning for warning in model.report.warnings)


def test_a_folder_that_is_not_of_the_set_has_no_such_masses(folder):
    model = load_object(ObjectParameters(name="folder", folder=str(folder), id="mug"))
    assert model.mass_kg == pytest.approx(250 * 0.05 * 0.06 * 0.07)


def test_a_sweep_takes_objects_by_name_and_by_glob(folder):
    where = ["object=ycb", f"object.folder={folder}"]
    named = expand_sweep([*where, "object.id=mug,d_cups"])
    assert [cell[-1] for cell in named] == ["object.id=mug", "object.id=d_cups"]
    globbed = expand_sweep([*where, "object.id=glob(*m*)"])
    assert [cell[-1] for cell in globbed] == ["object.id=mug", "object.id=something_else"]
    assert len(expand_sweep([*where, "object.id=glob(*)"])) == 3
    with pytest.raises(ConfigurationError, match="matches no option"):
        expand_sweep(["object=duck", "object.id=glob(*)"])


def test_what_an_object_is_called_is_known_before_it_is_loaded(folder):
    assert object_name(ObjectParameters(name="ycb", folder=str(folder), id="mug")) == "mug"
    assert object_name(ObjectParameters(name="random", id=7)) == "random_7"
    assert object_name(ObjectParameters(name="random")) == "random_0"
    assert object_name(ObjectParameters(mesh=str(folder / "mug" / "textured.obj"))) == "mug"
