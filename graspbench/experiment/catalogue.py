"""What there is to choose from, as rows for people and machines."""

from typing import Any

from graspbench.experiment.compose import group_options
from graspbench.experiment.config import load_config
from graspbench.geometry import catalogue_entry, list_objects


def describe_objects() -> list[dict[str, Any]]:
    """Return one row an object of the catalogue."""
    rows = []
    for name in list_objects():
        entry = catalogue_entry(name)
        rows.append(
            {
                "name": name,
                "shape": entry.shape.get("kind"),
                "description": entry.description,
                "licence": entry.licence,
            }
        )
    return rows


def describe_hands() -> list[dict[str, Any]]:
    """Return one row a hand of the configuration group ``hand``."""
    from graspbench.hand import GraspChecker, load_hand

    rows = []
    for option in group_options()["hand"]:
        hand = load_hand(load_config([f"hand={option}", "record=off"]).hand)
        rows.append(
            {
                "name": option,
                "fingers": hand.n_fingers,
                "joints": hand.n_joints,
                "tip_radius_mm": 1e3 * hand.tip_radius_m,
                "span_mm": 1e3 * GraspChecker(hand).pair_limit_m,
            }
        )
    return rows
