"""Which hand and object grasps are evaluated for, composed from the names of their options."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from graspbench.config.trial_config import TrialConfig, load_config

_MESHES = (".obj", ".stl", ".ply", ".glb", ".off")


def hand_and_object(
    hand: str, object_name: str, overrides: Sequence[str], config_dir: Path | None
) -> TrialConfig:
    """Compose hand, object and quality; all fingers of the hand are used unless ``hand.fingers`` is set.

    Args:
        hand: An option of the group ``hand``.
        object_name: An option of the group ``object``, or a mesh file.
        overrides: Further options.
        config_dir: A user's folder with further groups and options.
    """
    is_mesh = Path(object_name).suffix.lower() in _MESHES
    chosen = f"object.mesh={_quoted(object_name)}" if is_mesh else f"object={object_name}"
    config = load_config(["record=off", f"hand={hand}", chosen, *overrides], config_dir)
    fingers = len(config.hand.chains)
    if config.hand.kind == "urdf" and not any(text.startswith("hand.fingers=") for text in overrides):
        config = dataclasses.replace(config, hand=dataclasses.replace(config.hand, fingers=fingers))
    return config


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"
