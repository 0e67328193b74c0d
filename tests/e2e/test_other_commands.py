"""Configuration, catalogue, hands, logs, completion and help."""

import re
import shlex

import pytest
import yaml

from graspbench.cli.arguments import complete_override


def test_config_prints_what_overrides_make(cli):
    finished = cli("config", "object=bottle", "index.k_cm=0", "hand.fingers=4")
    assert finished.code == 0, finished.stderr
    tree = yaml.safe_load(finished.stdout)
    assert tree["object"]["name"] == "bottle"
    assert tree["index"]["k_cm"] == 0
    assert tree["hand"]["fingers"] == 4


def test_objects_and_hands_are_listed(cli):
    objects = cli("objects", "list", "--json").document["rows"]
    assert {"teddy", "duck", "bottle", "cylinder"} <= {row["name"] for row in objects}
    hands = cli("hands", "list", "--json").document
    assert {"radial", "allegro"} <= {row["name"] for row in hands}


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("obj", "object="),
        ("object=te", "object=teddy"),
        ("hand=", "hand=allegro"),
        ("index.k_", "index.k_cm="),
        ("stations.in", "stations.inner.count="),
    ],
)
def test_completion_offers_groups_options_and_keys(typed, offered):
    assert offered in complete_override(typed)


@pytest.mark.parametrize(
    ("words", "here"),
    [
        (["run", "--multirun", "object=teddy,duck"], "graspbench sweep"),
        (["run", "--cfg", "job"], "graspbench config"),
        (["sweep", "-m", "seed=1,2"], "graspbench sweep"),
        (["run", "--config-name=mine"], "experiment=NAME"),
    ],
)
def test_options_of_hydra_are_answered_with_what_does_it_here(cli, words, here):
    finished = cli(*words)
    assert finished.code == 2
    assert here in finished.stderr
    assert len(finished.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("value", ["a=b.stl", "it's.stl", "a#b.stl", 'a"b.stl'])
def test_a_value_that_needs_quotes_is_told_with_them(cli, value):
    finished = cli("config", f"object.name={value}")
    assert finished.code == 2
    (_, command) = finished.stderr.strip().removesuffix(".").split("quote the value: ")
    (override,) = shlex.split(command)
    assert yaml.safe_load(cli("config", override).stdout)["object"]["name"] == value


@pytest.mark.parametrize("command", ["run", "sweep", "manipulate"])
def test_help_has_groups_and_examples_and_no_type_of_flags(cli, command):
    text = cli(command, "-h").stdout
    assert "<bool>" not in text
    assert re.search(r"Groups.*camera, .*surface", text, re.DOTALL)
    assert text.count(f"graspbench {command} ") >= 3


def test_version_tells_the_commit(cli):
    finished = cli("--version")
    assert finished.code == 0
    assert re.fullmatch(
        r"graspbench \S+( \(commit [0-9a-f]{10}(, with changed files)?\))?\n", finished.stdout
    )


@pytest.mark.parametrize("words", [["-h"], ["run", "-h"], ["objects", "check", "-h"]])
def test_help_has_a_short_name(cli, words):
    finished = cli(*words)
    assert finished.code == 0
    assert "Usage:" in finished.stdout


def test_help_names_every_command(cli):
    finished = cli("--help")
    assert finished.code == 0
    for command in (
        "run",
        "sweep",
        "report",
        "paper",
        "manipulate",
        "config",
        "objects",
        "hands",
        "log",
        "bench",
    ):
        assert command in finished.stdout
