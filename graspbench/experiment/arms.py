"""An arm of one's own: read from a published file, and listed."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.config.bounds import bounds_of
from graspbench.config.groups import group_options
from graspbench.config.trial_config import load_config
from graspbench.errors import GraspbenchError, HandError
from graspbench.experiment.hands import plain_name
from graspbench.hand.files import find_urdf
from graspbench.results.store import write_atomically
from graspbench.simulation.arm_parameters import ArmParameters
from graspbench.simulation.mounts.arm_file import PREFIX, ArmFile, read_arm


def add_arm(parameters: ArmParameters, name: str | None, config_dir: Path) -> dict[str, Any]:
    """Read an arm from a URDF and write its description into a configuration folder.

    Args:
        parameters: The file, and what the user knows better.
        name: What to call the arm; by default as the file.
        config_dir: The user's configuration folder; it is made where there is none.

    Returns:
        What was found, and the file written.

    Raises:
        HandError: The file cannot be read, or is no arm.
    """
    name = name or plain_name(Path(parameters.urdf or "").stem)
    if name != plain_name(name):
        raise HandError(f"'{name}' is no name for an arm", remedy="use letters, digits and '_' (--name)")
    parameters = replace(parameters, name=name)
    arm = read_arm(parameters)
    urdf = parameters.urdf or ""
    if "://" not in urdf:
        urdf = str(find_urdf(urdf, parameters.package_dirs, name)[0])
    text = _text(replace(parameters, urdf=urdf), arm)
    target = config_dir.expanduser().resolve() / "arm" / f"{name}.yaml"
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(target, text.encode())
    except OSError as error:
        raise HandError(
            f"the arm's file cannot be written to '{target.parent}' ({error.strerror})",
            remedy="give a folder that can be written with --config-dir",
        ) from error
    return {"name": name, **_found(arm), "description": str(target)}


def describe_arms(config_dir: Path | None = None) -> list[dict[str, Any]]:
    """Return one row an option of the configuration group ``arm``.

    Args:
        config_dir: A folder with further arms; one of these that cannot be read says why.
    """
    rows: list[dict[str, Any]] = []
    for option in group_options(config_dir)["arm"]:
        try:
            parameters = load_config([f"arm={option}", "record=off"], config_dir).arm
            found = {} if parameters.urdf is None else _found(read_arm(parameters))
        except GraspbenchError as error:
            rows.append({"name": option, "problem": str(error)})
            continue
        rows.append({"name": option, **found})
    return rows


def _found(arm: ArmFile) -> dict[str, Any]:
    return {
        "joints": len(arm.joints),
        "tip": arm.tip.removeprefix(PREFIX),
        "flange_mm": (1e3 * arm.transform_flange_to_tip[:3, 3]).round(3).tolist(),
        "slowest_joint_deg_s": float(np.degrees(arm.speed_limits.min())),
    }


def _text(p: ArmParameters, arm: ArmFile) -> str:
    """Return the file of the configuration group ``arm``, every guess with a comment that says why."""
    flange = arm.transform_flange_to_tip
    angles = Rotation.from_matrix(flange[:3, :3]).as_euler("xyz", degrees=True)
    units = [1e3 if slides else float(np.degrees(1.0)) for slides in arm.slides]
    bounds = bounds_of("speed_limits_deg", False, None)  # files state speeds that no arm has
    speeds = np.clip(np.array(units) * arm.speed_limits, bounds.smallest, bounds.high).round(6).tolist()
    lines = [
        f"# Arm '{p.name}', read from {p.urdf}.",
        "# Everything below was found in the file and may be changed here.",
        f"name: {_quoted(p.name)}",
        f"urdf: {_quoted(p.urdf or '')}",
    ]
    if p.package_dirs:
        lines.append(f"package_dirs: [{', '.join(_quoted(folder) for folder in p.package_dirs)}]")
    lines += [
        "# The link that stands on the table or on a pedestal.",
        f"base: {_quoted(arm.root.removeprefix(PREFIX))}",
        "# The link that carries the hand: the last one that all chains of joints have in common. What hangs",
        "# on it, such as a gripper, is left out.",
        f"tip: {_quoted(arm.tip.removeprefix(PREFIX))}",
        "# The flange in that link: where its shapes end along the last joint's axis, z outwards.",
        f"flange_xyz_m: {_row(flange[:3, 3])}",
        f"flange_rpy_deg: {_row(angles)}",
        "# The palm's pose in the flange may be stated by palm_xyz_m and palm_rpy_deg. Without them the hand",
        "# is bolted on by a straight, a 45 deg or a right-angled bracket, as suits the grasp.",
        f"# Speeds of {', '.join(joint.removeprefix(PREFIX) for joint in arm.joints)}: deg/s, slides mm/s.",
        f"speed_limits_deg: {_row(speeds)}",
    ]
    return "\n".join(lines) + "\n"


def _row(values: Sequence[float] | np.ndarray[Any, Any]) -> str:
    return f"[{', '.join(repr(round(float(value), 6) + 0.0) for value in values)}]"


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
