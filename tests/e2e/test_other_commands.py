"""Configuration, catalogue, hands, logs, completion and help."""

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
