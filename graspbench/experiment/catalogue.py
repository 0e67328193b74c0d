"""What there is to choose from, as rows for people and machines."""

from pathlib import Path
from typing import Any

from graspbench.config.groups import group_options
from graspbench.config.trial_config import load_config
from graspbench.errors import GraspbenchError
from graspbench.experiment.objects import describe_model
from graspbench.geometry import ObjectParameters, catalogue_entry, list_objects, load_object

_PROPERTIES = (
    "extents_mm",
    "mass_kg",
    "friction",
    "genus",
    "watertight",
    "triangles",
    "collision_pieces",
)


def describe_objects(*, properties: bool = False) -> list[dict[str, Any]]:
    """Return one row an object of the catalogue.

    Args:
        properties: Load every object and add its size, mass, friction, topology and source; without it only
            the catalogue's files are read.
    """
    rows = []
    for name in list_objects():
        entry = catalogue_entry(name)
        row: dict[str, Any] = {"name": name, "shape": entry.shape.get("kind")}
        if properties:
            described = describe_model(load_object(ObjectParameters(name=name)))
            row |= {key: described[key] for key in _PROPERTIES} | {"source": entry.source}
        else:
            row["description"] = entry.description
        rows.append(row | {"licence": entry.licence})
    return rows


def describe_hands(config_dir: Path | None = None) -> list[dict[str, Any]]:
    """Return one row a hand of the configuration group ``hand``.

    Args:
        config_dir: A folder with further hands; one of these that cannot be loaded says why.
    """
    from graspbench.hand import GraspChecker, load_hand

    rows: list[dict[str, Any]] = []
    for option in group_options(config_dir)["hand"]:
        try:
            hand = load_hand(load_config([f"hand={option}", "record=off"], config_dir).hand)
        except GraspbenchError as error:
            rows.append({"name": option, "problem": str(error)})
            continue
        rows.append(
            {
                "name": option,
                "fingers": hand.n_fingers,
                "joints": hand.n_joints,
                "tip_radius_mm": 1e3 * hand.pad_radius_m,
                "span_mm": 1e3 * GraspChecker(hand).pair_limit_m,
            }
        )
    return rows
