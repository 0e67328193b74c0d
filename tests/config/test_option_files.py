"""The files of a user's configuration folder: used, or refused in one sentence that names the file."""

import os

import pytest
import yaml

from graspbench.config import option_files
from graspbench.config.trial_config import load_config, load_stored_config
from graspbench.errors import ConfigurationError

BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{chr(98 + k)}: &{chr(98 + k)} [{', '.join(['*' + chr(97 + k)] * 10)}]\n" for k in range(8)
)
BAD = {
    "syntax": (b"width: [1,\n", "no YAML that can be used"),
    "tab": (b"\twidth: 1\n", "no YAML that can be used"),
    "list": (b"- width\n- 3\n", "no mapping of options"),
    "number": (b"3\n", "no mapping of options"),
    "twice": (b"width: 100\nwidth: 200\n", "the key 'width' stands twice, line 2"),
    "latin": ("# gr\u00f6\u00dfe\nwidth: 100\n".encode("latin-1"), "not UTF-8"),
    "bomb": (BOMB.encode(), "unfolds to more than"),
    "self": (b"a: &a [*a]\n", "unfolds to more than"),
    "deep": (b"a: " + b"[" * 5000 + b"]" * 5000, "nested too deeply"),
    "tagged": (b"width: !!python/object/apply:os.getpid []\n", "no YAML that can be used"),
    "binary": (b"width: !!binary aGVsbG8=\n", "cannot be used"),
    "date": (b"width: 2020-01-01\n", "cannot be used"),
    "bad_date": (b"width: 2020-99-99\n", "cannot be read"),
    "surrogate": (b'width: "\\ud800"\n', "no valid text"),
    "zero_byte": (b'width: "\\0"\n', "no valid text"),
    "environment": (b"width: ${oc.env:HOME}\n", "takes a value from where it is read"),
    "unknown_key": (b"widht: 3\n", "unknown option 'camera.widht'"),
    "itself": (b"defaults:\n  - itself\nwidth: 100\n", "include themselves"),
    "no_option": (b"defaults:\n  - nowhere\nwidth: 100\n", "cannot be composed"),
    "odd_defaults": (b"defaults: 3\nwidth: 100\n", "cannot be composed"),
    "odder_defaults": (b"defaults:\n  - [1, 2]\n  - {a: {b: c}}\n", "cannot be composed"),
}  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "camera").mkdir()
    return tmp_path


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_named_in_one_sentence(folder, name):
    content, said = BAD[name]
    (folder / "camera" / f"{name}.yaml").write_bytes(content)
    with pytest.raises(ConfigurationError) as caught:
        load_config([f"camera={name}"], folder)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 700


@pytest.mark.parametrize("place", ["", "camera/a", "camera/a/b/c", "elsewhere/.x"])
@pytest.mark.parametrize("name", ["bomb", "latin"])
def test_a_bad_file_that_another_names_is_found_at_any_depth(folder, place, name):
    content, said = BAD[name]
    (folder / place).mkdir(parents=True, exist_ok=True)
    (folder / place / "bad.yaml").write_bytes(content)
    named = place.removeprefix("camera/") if place.startswith("camera/") else f"/{place}"
    (folder / "camera" / "good.yaml").write_text(f"defaults:\n  - {named.rstrip('/')}/bad\n")
    with pytest.raises(ConfigurationError, match=said):
        load_config(["camera=good"], folder)


def test_a_folder_without_an_end_is_no_folder_of_options(folder, monkeypatch):
    monkeypatch.setattr(option_files, "MAX_ENTRIES", 300)
    (folder / "camera" / "again").symlink_to(folder)
    (folder / "camera" / "more").symlink_to(folder)
    with pytest.raises(ConfigurationError, match="holds more than"):
        load_config(["camera=default"], folder)


@pytest.mark.parametrize("kind", ["fifo", "folder", "dangling"])
def test_what_is_no_file_is_not_opened(folder, kind):
    path = folder / "camera" / "odd.yaml"
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to(folder / "nowhere")
    with pytest.raises(ConfigurationError, match=r"there is no file .*odd\.yaml"):
        load_config(["camera=odd"], folder)


@pytest.mark.parametrize(
    "name", ["é", "a,b", "a=b", "it's", "#1", "[x]", "a b", "{x}", "$HOME", "${seed}", "%41", '"', "a:b"]
)
def test_a_folder_may_be_called_anything(tmp_path, name):
    camera = tmp_path / name / "camera"
    camera.mkdir(parents=True)
    (camera / "mine.yaml").write_text("defaults:\n  - default\n  - _self_\nwidth: 333\n")
    config = load_config(["camera=mine"], tmp_path / name)
    assert config.camera.width == 333
    assert config.camera.height == load_config().camera.height


def test_nothing_of_the_environment_comes_into_a_configuration():
    with pytest.raises(ConfigurationError, match="only other keys"):
        load_config(["object.name=${oc.env:HOME}"])
    assert load_config(["camera.width=${camera.height}"]).camera.width == load_config().camera.height


@pytest.mark.parametrize(
    "name", [name for name in BAD if "default" not in name and name not in ("itself", "no_option")]
)
def test_a_bad_stored_configuration_is_named(tmp_path, name):
    path = tmp_path / "config.yaml"
    path.write_bytes(BAD[name][0])
    with pytest.raises(ConfigurationError) as caught:
        load_stored_config(path)
    assert "\n" not in str(caught.value)


def test_a_trial_stored_before_arms_were_a_group_can_be_run_again(tmp_path):
    tree = yaml.safe_load(load_config(["seed=3"]).as_yaml())
    tree["execution"] = {**tree["execution"], "mount": "floating"}
    path = tmp_path / "config.yaml"
    path.write_text(yaml.safe_dump(tree))
    assert load_stored_config(path).seed == 3
    tree["execution"]["mount"] = "kuka"
    path.write_text(yaml.safe_dump(tree))
    with pytest.raises(ConfigurationError, match="now the group 'arm'"):
        load_stored_config(path)
