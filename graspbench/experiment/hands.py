"""A hand of one's own: read from a published file, drawn, and checked."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from graspbench.errors import HandError
from graspbench.hand import load_hand
from graspbench.hand.files import find_urdf
from graspbench.hand.importing.arms import without_arm
from graspbench.hand.importing.description import description_text
from graspbench.hand.importing.importer import Guesses, import_hand
from graspbench.hand.importing.mjcf import urdf_of_mjcf
from graspbench.results.store import write_atomically


def add_hand(file: Path | str, name: str | None, guesses: Guesses, config_dir: Path) -> dict[str, Any]:
    """Read a hand from a URDF or MJCF file and write its description into a configuration folder.

    Args:
        file: The file: a path, or ``package://PACKAGE/PATH`` of an installed package.
        name: What to call the hand; by default as the file.
        guesses: What the user knows better.
        config_dir: The user's configuration folder; it is made where there is none.

    Returns:
        What was found, and the files written.

    Raises:
        HandError: The file cannot be read, or is no hand.
    """
    from graspbench.report.hand_picture import draw_hand  # loads Matplotlib

    source, _ = find_urdf(str(file), guesses.package_dirs, name or Path(file).stem)
    name = name or plain_name(source.stem)
    if name != plain_name(name):
        raise HandError(f"'{name}' is no name for a hand", remedy="use letters, digits and '_' (--name)")
    folder = config_dir.expanduser().resolve() / "hand"
    if _is_mjcf(source):
        source = urdf_of_mjcf(source, name, folder / name)
    source = without_arm(source, name, folder / name, guesses.palm, guesses.package_dirs)
    found = import_hand(source, name, guesses)
    target = folder / f"{name}.yaml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(target, description_text(found, str(file)).encode())
        picture = draw_hand(found.hand, folder / name / f"{name}.png")
    except OSError as error:
        raise HandError(
            f"the hand's files cannot be written to '{folder}' ({error.strerror})",
            remedy="give a folder that can be written with --config-dir",
        ) from error
    p = found.parameters
    return {
        "name": name,
        "palm": p.palm.link,
        "fingers": [finger.name for finger in p.chains],
        "used": list(found.hand.finger_names),
        "tip_shape": p.tip_shape,
        "tip_radius_mm": 1e3 * p.tip_radius_m,
        "tips": {tip: found.tips[tip].source for tip in found.tips},
        "locked_joints": sorted({*found.structure.wrist, *p.locked_deg}),
        "followers": {each.name: each.leader for each in found.hand.followers},
        "opposes_around_mm": 2e3 * found.opposition.gap_m,
        "imbalance": found.opposition.imbalance,
        "description": str(target),
        "picture": str(picture),
    }


def show_hand(
    name: str, overrides: Sequence[str], folder: Path, config_dir: Path | None = None
) -> dict[str, Any]:
    """Draw a hand open and closed, with its palm frame.

    Args:
        name: An option of the configuration group ``hand``.
        overrides: Options such as ``hand.fingers=4``.
        folder: Where the picture goes.
        config_dir: A folder with further configuration groups and options.
    """
    from graspbench.config.trial_config import load_config  # loads what no hand that is added needs
    from graspbench.hand import GraspChecker
    from graspbench.report.hand_picture import draw_hand

    hand = load_hand(load_config([f"hand={name}", "record=off", *overrides], config_dir).hand)
    return {
        "name": name,
        "fingers": list(hand.finger_names),
        "joints": list(hand.joint_names),
        "followers": {each.name: each.leader for each in hand.followers},
        "tip_shape": "link" if hand.tips_are_links else "sphere",
        "tip_radius_mm": 1e3 * hand.pad_radius_m,
        "span_mm": 1e3 * GraspChecker(hand).pair_limit_m,
        "urdf": str(hand.urdf_path),
        "picture": str(draw_hand(hand, folder / f"{name}.png")),
    }


def _is_mjcf(path: Path) -> bool:
    start = path.read_bytes()[:4096].lstrip()
    return b"<mujoco" in start and b"<robot" not in start


def plain_name(name: str) -> str:
    """Return a name as it may stand in a configuration: letters, digits and underscores."""
    return (
        "".join(letter if letter.isalnum() and letter.isascii() else "_" for letter in name).strip("_")
        or "hand"
    )
