import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspbench.config.schema import PLUGGED
from graspbench.errors import ConfigurationError
from graspbench.experiment import config_from_tree, expand_sweep, group_options, load_config


def test_defaults_compose_and_validate():
    config = load_config()
    assert config.object.name == "teddy"
    assert config.hand.name == "radial"
    assert config.index_name == "force_field"


def test_every_option_of_every_group_composes():
    for group, options in group_options().items():
        if group in {"clik", "motion", "experiment"}:
            continue
        for option in options:
            extra = ["hand.fingers=3"] if group == "index" else []
            tree = load_config([f"{group}={option}", *extra]).tree
            assert group not in PLUGGED or tree[group]["name"] in PLUGGED[group][0].names()


def test_value_overrides_reach_the_parameters():
    config = load_config(["hand.fingers=4", "index.k_cm=0", "stations.inner.count=0", "seed=7"])
    assert config.hand.fingers == 4
    assert config.index.k_cm == 0
    assert config.stations.inner.count == 0
    assert config.seed == 7


def test_a_tree_read_back_gives_the_same_trial():
    config = load_config(["object=bottle", "hand.fingers=4"])
    assert config_from_tree(config.as_tree()).trial_id == config.trial_id


def test_identity_depends_on_what_is_run_and_not_on_what_is_recorded():
    plain = load_config().trial_id
    assert load_config(["record=off"]).trial_id == plain
    assert load_config(["seed=1"]).trial_id != plain
    assert load_config(["surface.nodes=800"]).trial_id != plain


def test_identity_follows_the_content_of_a_users_mesh(tmp_path):
    mesh = tmp_path / "thing.stl"
    mesh.write_bytes(b"one")
    first = load_config([f"object.mesh={mesh}"]).trial_id
    mesh.write_bytes(b"two")
    assert load_config([f"object.mesh={mesh}"]).trial_id != first


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["object=tedy"], ["unknown object", "teddy"]),
        (["hand.fingrs=3"], ["unknown option", "hand.fingers"]),
        (["hand.fingers=many"], ["hand.fingers", "many"]),
        (["surface.nodes=-4"], ["surface.nodes", "-4"]),
        (["hand=radial,allegro"], ["sweep"]),
        (["index=wishful"], ["unknown index", "force_field"]),
        (["~seed"], ["deletes"]),
        (["a b c"], ["a b c"]),
        (["object"], ["object"]),
        (["stations.inner=4"], ["stations.inner.count"]),
        (
            ["index=quality_ascent", "index.k_cm=0"],
            ["quality_ascent has no", "belongs to force_field", "[index=quality_ascent]", "grids"],
        ),
        (["seed=-1"], ["seed"]),
        (["seed=1.5"], ["seed"]),
    ],
)
def test_every_mistake_is_one_sentence(overrides, words):
    with pytest.raises(ConfigurationError) as caught:
        load_config(overrides)
    text = str(caught.value)
    assert "\n" not in text
    for word in words:
        assert word in text


def test_sweep_grammar_makes_the_grid():
    grid = expand_sweep(["object=teddy,bottle", "index.k_cm=0,1", "seed=range(0,3)", "surface.nodes=500"])
    assert len(grid) == 12
    assert grid[0] == ("object=teddy", "index.k_cm=0", "seed=0", "surface.nodes=500")
    assert grid[-1] == ("object=bottle", "index.k_cm=1", "seed=2", "surface.nodes=500")


def test_glob_takes_every_option_of_a_group():
    grid = expand_sweep(["stations=glob(*)"])
    assert {cell[0] for cell in grid} == {f"stations={name}" for name in group_options()["stations"]}


@given(st.lists(st.integers(0, 9), min_size=2, max_size=4, unique=True), st.integers(2, 4))
def test_grid_size_is_the_product_of_the_axes(seeds, count):
    grid = expand_sweep([f"seed={','.join(map(str, seeds))}", f"surface.nodes=range(100,{100 + count})"])
    assert len(grid) == len(seeds) * count
    assert len(set(grid)) == len(grid)


def test_a_users_folder_adds_options(tmp_path):
    (tmp_path / "stations").mkdir()
    (tmp_path / "stations" / "few.yaml").write_text("inner:\n  count: 2\n")
    assert load_config(["stations=few"], tmp_path).stations.inner.count == 2
    with pytest.raises(ConfigurationError, match="unknown stations"):
        load_config(["stations=few"])


def test_a_mistake_in_a_users_file_is_named(tmp_path):
    (tmp_path / "stations").mkdir()
    (tmp_path / "stations" / "odd.yaml").write_text("innner:\n  count: 2\n")
    with pytest.raises(ConfigurationError, match=r"stations\.innner"):
        load_config(["stations=odd"], tmp_path)
