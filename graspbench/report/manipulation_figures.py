"""Pictures and tables of an in-hand manipulation."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.manipulation_result import ManipulationResult
from graspbench.manipulation.sliding.sliding_history import SlidingHistory
from graspbench.report.style import INK, canvas, save

# Colour-blind safe, and of different lightness.
_COLOURS = ("#0b5fa5", "#d1495b", "#e0a100", "#3b7d4f", "#7a4fa3")
_STYLES = ("-", "--", "-.", ":", (0, (1, 3)))


def draw_manipulation(
    result: ManipulationResult, fingers: Mapping[str, IntArray], path: Path, *, title: str
) -> Path:
    """Draw the object's motion, its pose error and the joints by time.

    Args:
        result: The motion.
        fingers: The joints of each grasping finger, indices into the joint vector, by the finger's name.
        path: The PNG to write.
        title: Above the picture.
    """
    figure = canvas(1000, 1000)
    figure.set_layout_engine("constrained")
    figure.suptitle(title, color=INK, fontsize=13, x=0.01, ha="left")
    axes = figure.subplots(3, 1, sharex=True)
    _object_motion(axes[0], result)
    _pose_error(axes[1], result)
    _joints(axes[2], result, fingers)
    for axis in axes:
        axis.grid(color="0.92")
        axis.spines["top"].set_visible(False)
        axis.margins(x=0.0)
    axes[2].set_xlabel("time (s)")
    return save(figure, path)


def write_manipulation(result: ManipulationResult, path: Path) -> Path:
    """Write all histories as one CSV file, a row a control period, with units in the names."""
    history = result.history
    columns: dict[str, FloatArray] = {"time_s": history.times}
    moved, desired = _motion(result), result.desired_transforms_object_to_palm
    for k, axis in enumerate("xyz"):
        columns[f"object_{axis}_m"] = result.transforms_object_to_palm[:, k, 3]
        columns[f"desired_{axis}_m"] = desired[:, k, 3]
        columns[f"turned_{axis}_deg"] = moved[:, 3 + k]
    columns["position_error_m"] = result.position_error_m
    columns["rotation_error_deg"] = result.rotation_error_deg
    columns["closed_chain_residual_m"] = history.closed_chain_residual_m
    columns["smallest_singular_value"] = history.smallest_singular_value
    for k, name in enumerate(result.joint_names):
        columns[f"{name}_rad"] = history.joints[:, k]
        columns[f"{name}_rad_s"] = history.velocities[:, k]
    for i in range(result.contact_points.shape[1]):
        for k, axis in enumerate("xyz"):
            columns[f"contact_{i}_{axis}_m"] = result.contact_points[:, i, k]
        columns[f"contact_{i}_drift_m"] = result.contact_drift_m[:, i]
    for k, name in enumerate(history.task_names):
        columns[f"activation_{name}"] = history.activations[:, k]
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")
    return path


def write_sliding(result: ManipulationResult, sliding: SlidingHistory, path: Path) -> Path:
    """Write forces, slip and margins of all contacts as one CSV file, a row whenever forces were computed."""
    columns: dict[str, FloatArray] = {"time_s": result.force_times}
    for i in range(result.forces.shape[1]):
        for k, axis in enumerate("xyz"):
            columns[f"force_{i}_{axis}_n"] = result.forces[:, i, k]
        columns[f"torsion_{i}_nm"] = result.torsions[:, i]
        columns[f"margin_{i}_n"] = sliding.margins[:, i]
        for k, axis in enumerate("xyz"):
            columns[f"slip_{i}_{axis}_m_s"] = sliding.slips[:, i, k]
        columns[f"spin_{i}_rad_s"] = sliding.spins[:, i]
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")
    return path


def _motion(result: ManipulationResult) -> FloatArray:
    """Return displacement, mm, and rotation vector, deg, since the start in palm axes, shape (t, 6)."""
    poses = result.transforms_object_to_palm
    moved = np.empty((len(poses), 6))
    moved[:, :3] = 1e3 * (poses[:, :3, 3] - poses[0, :3, 3])
    turns = poses[:, :3, :3] @ poses[0, :3, :3].T
    moved[:, 3:] = Rotation.from_matrix(turns).as_rotvec(degrees=True)
    return moved


def _object_motion(axis: Axes, result: ManipulationResult) -> None:
    times, moved = result.history.times, _motion(result)
    turning = axis.twinx()
    for k, name in enumerate("xyz"):
        axis.plot(times, moved[:, k], color=_COLOURS[k], lw=5, alpha=0.4, label=f"moved along {name}")
        turning.plot(times, moved[:, 3 + k], color=_COLOURS[k], lw=2, ls="--", label=f"turned about {name}")
    axis.set_ylabel("displacement (mm)")
    turning.set_ylabel("rotation (deg), dashed")
    turning.spines["top"].set_visible(False)
    turning.margins(x=0.0)
    lines = [*axis.get_lines(), *turning.get_lines()]
    axis.legend(handles=lines, ncols=2, frameon=False, fontsize=9, loc="upper right")
    axis.set_title("Object, palm axes", loc="left", fontsize=11, color=INK)


def _pose_error(axis: Axes, result: ManipulationResult) -> None:
    times = result.history.times
    floor = 1e-9  # nothing below a picometre and a nanodegree means anything
    axis.semilogy(
        times,
        np.maximum(1e3 * result.position_error_m, floor),
        color=_COLOURS[0],
        lw=2,
        label="position (mm)",
    )
    axis.semilogy(
        times,
        np.maximum(result.rotation_error_deg, floor),
        color=_COLOURS[1],
        lw=2,
        ls="--",
        label="orientation (deg)",
    )
    drift = 1e3 * result.contact_drift_m.max(axis=1)
    axis.semilogy(
        times, np.maximum(drift, floor), color=_COLOURS[3], lw=1.5, ls=":", label="contact drift (mm)"
    )
    axis.axhline(0.1, color="0.4", lw=1)
    axis.annotate(
        "0.1 mm, 0.1 deg", (times[-1], 0.1), (-4, -4), textcoords="offset points", ha="right", va="top",
        fontsize=9, color="0.3",
    )  # fmt: skip
    axis.set_ylabel("error (mm, deg)")
    axis.legend(frameon=False, fontsize=9, loc="lower right", ncols=3)
    axis.set_title("Pose error", loc="left", fontsize=11, color=INK)


def _joints(axis: Axes, result: ManipulationResult, fingers: Mapping[str, IntArray]) -> None:
    times, joints = result.history.times, np.rad2deg(result.history.joints)
    names = []
    for i, (name, own) in enumerate(fingers.items()):
        colour = _COLOURS[i % len(_COLOURS)]
        for k, joint in enumerate(own):
            axis.plot(times, joints[:, joint], color=colour, ls=_STYLES[k % len(_STYLES)], lw=1.6)
        names.append(Line2D([], [], color=colour, lw=2, label=name))
    longest = max(len(own) for own in fingers.values())
    ranks = [
        Line2D([], [], color="0.3", ls=_STYLES[k % len(_STYLES)], lw=1.6, label=f"joint {k + 1}")
        for k in range(longest)
    ]
    axis.legend(
        handles=[*names, *ranks], frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5)
    )
    axis.set_ylabel("joints (deg)")
    axis.set_title("Joints of the grasping fingers", loc="left", fontsize=11, color=INK)
