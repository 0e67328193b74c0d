"""The options composed are those that Hydra itself composes, whatever was composed before."""

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf

from graspbench.config.groups import CONF_DIR, store_options_without_file
from graspbench.config.hydra_composition import compose_files


def by_hydra(primary, overrides):
    """Return what Hydra's public interface composes, its own configuration apart, and the choices it made."""
    GlobalHydra.instance().clear()
    with initialize_config_dir(config_dir=str(CONF_DIR), version_base="1.3"):
        found = compose(primary, overrides=overrides, return_hydra_config=True)
    made = {key: option for key, option in found.hydra.runtime.choices.items() if "hydra/" not in key}
    values = OmegaConf.to_container(found)
    return {key: value for key, value in values.items() if key != "hydra"}, made


@pytest.mark.parametrize(
    ("primary", "overrides"),
    [
        ("config", []),
        ("config", ["object=duck", "hand=allegro", "execution=off"]),
        ("manipulate", ["motion=gait", "clik=qp"]),
        ("config", ["experiment@_global_=quick"]),
        (
            "config",
            ["record=full"],
        ),  # the default: nothing of an experiment is left in the files that are kept
    ],
)
def test_the_same_as_hydra_composes(primary, overrides):
    store_options_without_file(None)
    assert compose_files(primary, overrides, None) == by_hydra(primary, overrides)


def test_a_users_file_is_read_anew(tmp_path):
    (tmp_path / "quality").mkdir()
    file = tmp_path / "quality" / "mine.yaml"
    for friction in (0.4, 0.6):
        file.write_text(f"friction: {friction}\n")
        values, made = compose_files("config", ["quality=mine"], tmp_path)
        assert (values["quality"]["friction"], made["quality"]) == (friction, "mine")
