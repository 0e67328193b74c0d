from dataclasses import fields, replace
from importlib.resources import files

import numpy as np
import pytest
import trimesh
import yaml
from pydantic import TypeAdapter

from graspbench.cli.arguments import complete_override
from graspbench.errors import ConfigurationError, MeshError
from graspbench.experiment import describe_objects, expand_sweep, group_options, load_config
from graspbench.geometry import ObjectParameters, catalogue_entry, list_objects, load_object
from graspbench.geometry.convex_union import to_manifold
from graspbench.geometry.inspection import inspect
from graspbench.geometry.object_parameters import FILE_CHOICES

GENERATED = [name for name in list_objects() if catalogue_entry(name).source == "generated"]
CHOICES = files("graspbench.conf") / "object"
PUCK = (
    "name: puck\ndescription: A puck\nlicence: CC0\nsource: mine\n"
    "shape: {kind: cone, height_m: 0.03, bottom_diameter_m: 0.07, top_diameter_m: 0.07}\n"
)


@pytest.mark.parametrize("name", list_objects())
def test_every_object_fits_a_hand_and_is_what_a_trial_needs(name):
    model = load_object(ObjectParameters(name=name))
    largest, smallest = model.extents_m.max(), model.extents_m.min()
    assert 0.04 <= largest <= 0.155
    assert 0.025 <= smallest <= 0.11
    assert 0.01 < model.mass_kg < 0.4
    report = inspect(np.asarray(model.mesh.vertices), np.asarray(model.mesh.faces), name, trusted=True)[2]
    assert report.usable, report.problems
    assert (report.bodies, report.genus) == (1, 0)
    np.testing.assert_allclose(model.mesh.center_mass, 0.0, atol=1e-9)
    np.testing.assert_allclose(
        model.inertia, model.mesh.moment_inertia * model.mass_kg / model.mesh.volume, rtol=1e-6, atol=1e-12
    )
    assert model.licence
    assert model.source


@pytest.mark.parametrize("name", ["duck", "cross", "star", "trilobe", "spool", "teddy", "hammer"])
def test_collision_parts_stay_within_two_millimetres_and_three_percent(name):
    model = load_object(ObjectParameters(name=name))
    solid = to_manifold(model.mesh.vertices, model.mesh.faces)
    union = to_manifold(model.collision_parts[0].vertices, model.collision_parts[0].faces)
    for part in model.collision_parts[1:]:
        union += to_manifold(part.vertices, part.faces)
    assert (union - solid).volume() < 0.03 * solid.volume()
    assert (solid - union).volume() < 0.03 * solid.volume()
    np.testing.assert_allclose(np.reshape(union.bounding_box(), (2, 3)), model.mesh.bounds, atol=2e-3)


def test_objects_are_described_with_what_a_trial_must_know():
    rows = describe_objects(properties=True)
    assert [row["name"] for row in rows] == list(list_objects())
    for row in rows:
        assert (row["watertight"], row["genus"]) == (True, 0)
        assert min(row["mass_kg"], row["friction"], *row["extents_mm"]) > 0.0
        assert row["collision_pieces"] >= 1
        assert row["licence"]
        assert row["source"]


def test_the_catalogue_is_large_and_licensed():
    assert len(GENERATED) >= 20
    assert {"teddy", "duck", "bottle", "cylinder", "easter_egg", "glass", "smooth_prism"} <= set(
        list_objects()
    )
    for name in list_objects():
        assert catalogue_entry(name).name == name


def test_configuration_choices_are_the_catalogue_and_the_users_files():
    assert set(group_options()["object"]) == {*list_objects(), *FILE_CHOICES}
    assert {item.name[:-5] for item in CHOICES.iterdir() if item.name.endswith(".yaml")} == set(FILE_CHOICES)
    for name in list_objects():
        assert load_config([f"object={name}"]).object == ObjectParameters(name=name)


@pytest.mark.parametrize("name", FILE_CHOICES)
def test_the_choices_for_files_show_every_parameter(name):
    content = yaml.safe_load((CHOICES / f"{name}.yaml").read_text())
    assert list(content) == [f.name for f in fields(ObjectParameters)]
    parameters = TypeAdapter(ObjectParameters).validate_python(content)
    assert parameters == ObjectParameters(name=name, id=parameters.id, repair=name == "ycb")


def test_a_new_object_is_one_file(tmp_path, monkeypatch):
    monkeypatch.setattr("graspbench.datasets.CATALOGUE_DIR", tmp_path)
    for name in ("teddy", "puck"):
        (tmp_path / f"{name}.yaml").write_text(PUCK.replace("puck", name))
    assert "puck" in group_options()["object"]
    assert expand_sweep(["object=glob(pu*)"]) == [("object=puck",)]
    assert complete_override("object=pu") == ["object=puck"]
    assert load_object(load_config(["object=puck", "object.scale=2"]).object).extents_m[2] == pytest.approx(
        0.06
    )


def test_a_users_file_comes_before_the_catalogue(tmp_path):
    (tmp_path / "object").mkdir()
    (tmp_path / "object" / "duck.yaml").write_text("name: duck\nscale: 0.5\n")
    (tmp_path / "object" / "bear.yaml").write_text("defaults: [teddy]\nscale: 0.5\n")
    assert load_config(["object=duck"], tmp_path).object == ObjectParameters(name="duck", scale=0.5)
    assert load_config(["object=bear"], tmp_path).object == ObjectParameters(scale=0.5)
    assert load_config(["object=duck"]).object == ObjectParameters(name="duck")


def test_the_teddy_bear_is_upright():
    model = load_object(ObjectParameters(name="teddy"))
    np.testing.assert_allclose(model.extents_m, [0.0765, 0.0631, 0.0935], atol=5e-4)
    assert len(model.collision_parts) == 15
    ears = model.mesh.vertices[model.mesh.vertices[:, 2] > 0.9 * model.mesh.bounds[1, 2]]
    assert np.ptp(ears[:, 0]) > 0.02  # two of them, side by side


def test_what_is_given_replaces_what_the_entry_says():
    plain = load_object(ObjectParameters(name="bottle"))
    changed = load_object(
        ObjectParameters(
            name="bottle", mass_kg=0.2, friction=0.9, rgba=(0, 0, 1, 1), scale=0.5, shape={"height_m": 0.2}
        )
    )
    assert (changed.mass_kg, changed.friction, changed.rgba) == (0.2, 0.9, (0, 0, 1, 1))
    np.testing.assert_allclose(changed.extents_m, [0.03, 0.03, 0.1], atol=1e-6)
    lighter = load_object(ObjectParameters(name="bottle", density_kg_m3=150.0))
    assert lighter.mass_kg == pytest.approx(0.5 * plain.mass_kg)
    parts = np.concatenate([part.vertices for part in changed.collision_parts])
    np.testing.assert_allclose(np.ptp(parts, axis=0), [0.03, 0.03, 0.1], atol=5e-4)


@pytest.mark.parametrize(("up", "tall"), [("x", 0), ("-y", 1), ("-z", 2)])
def test_an_axis_that_points_up_turns_mesh_and_parts(up, tall):
    plain = load_object(ObjectParameters(name="hammer"))
    turned = load_object(ObjectParameters(name="hammer", up=up))
    assert turned.extents_m[2] == pytest.approx(plain.extents_m[tall])
    parts = np.concatenate([part.vertices for part in turned.collision_parts])
    np.testing.assert_allclose(parts.min(axis=0), turned.mesh.bounds[0], atol=1e-3)


def test_a_mesh_replaces_the_shape_and_lends_its_name(tmp_path):
    path = tmp_path / "parts" / "brick.stl"
    path.parent.mkdir()
    trimesh.creation.box((40, 50, 60)).export(path)
    model = load_object(ObjectParameters(name="teddy", mesh=str(path), scale=0.001))
    assert model.name == "brick"
    np.testing.assert_allclose(model.extents_m, [0.04, 0.05, 0.06], atol=1e-6)
    assert load_object(ObjectParameters(name="my_brick", mesh=str(path), scale=0.001)).name == "my_brick"
    trimesh.creation.box((40, 50, 70)).export(path)  # a changed file is read again
    again = load_object(ObjectParameters(mesh=str(path), scale=0.001))
    assert again.extents_m[2] == pytest.approx(0.07)


def test_an_entry_of_the_users_own_is_one_file(tmp_path):
    path = tmp_path / "puck.yaml"
    path.write_text(PUCK)
    model = load_object(ObjectParameters(entry=str(path), shape={"height_m": 0.04}))
    assert (model.name, model.licence) == ("puck", "CC0")
    assert model.extents_m[2] == pytest.approx(0.04)


@pytest.mark.parametrize("number", [3, 137, 999])
def test_random_objects_are_one_body(number):
    model = load_object(ObjectParameters(name="random", id=number))
    assert model.name == f"random_{number}"
    assert 0.05 < model.extents_m.max() < 0.2


@pytest.mark.parametrize(
    ("number", "words"),
    [(72, "4 separate bodies"), (168, "no part that encloses a volume")],
)
def test_random_objects_that_cannot_be_used_say_why(number, words):
    with pytest.raises(MeshError, match=words) as caught:
        load_object(ObjectParameters(name="random", id=number))
    assert f"{number:03d}" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"name": "tedy"}, "unknown object 'tedy'"),
        ({"name": "mesh"}, "object=mesh needs a path"),
        ({"name": "folder"}, "object=folder needs a path"),
        ({"name": "bottle", "id": 3}, "not a family"),
        ({"name": "random", "id": 1000}, "id = 1000"),
        ({"name": "random", "id": "first"}, "id = 'first'"),
        ({"name": "bottle", "shape": {"heigth_m": 0.2}}, "unknown parameter 'heigth_m'"),
        ({"entry": "no/such/entry.yaml"}, "there is no file"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(change, words):
    with pytest.raises(ConfigurationError) as caught:
        load_object(replace(ObjectParameters(), **change))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name: [", "no YAML"),
        ("- 1\n- 2\n", "not a catalogue entry"),
        ("name: x\ncolour: red\n", "x.yaml"),
        ("name: x\ndescription: y\nlicence: z\nsource: s\nshape: {kind: egg}\ncolour: red\n", "'colour'"),
    ],
)
def test_broken_entries_are_refused(tmp_path, text, words):
    path = tmp_path / "x.yaml"
    path.write_text(text)
    with pytest.raises(ConfigurationError) as caught:
        load_object(ObjectParameters(entry=str(path)))
    assert words in str(caught.value)


def test_loading_twice_gives_the_same_bits():
    first, second = (load_object(ObjectParameters(name="duck")) for _ in range(2))
    np.testing.assert_array_equal(first.mesh.vertices, second.mesh.vertices)
    for a, b in zip(first.collision_parts, second.collision_parts, strict=True):
        np.testing.assert_array_equal(a.vertices, b.vertices)


def test_slits_between_convex_parts_are_closed_and_said():
    model = load_object(ObjectParameters(name="random", id=384))
    assert model.report.genus == 0
    assert any("spurious handles" in done for done in model.report.repairs)
