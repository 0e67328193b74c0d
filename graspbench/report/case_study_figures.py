"""Figures 4.4 to 4.7 of the case study, and its animation."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from graspbench.arrays import FloatArray
from graspbench.manipulation.case_study import CaseStudyResult, case_study_path, case_study_system
from graspbench.report import style

_HISTORY_RATE_HZ = 50.0
_STYLE = {True: ("-", "with secondary tasks"), False: ("--", "without secondary tasks")}


def draw_case_study(
    results: Sequence[CaseStudyResult], folder: Path, *, animation_frames: int = 90
) -> tuple[Path, ...]:
    """Draw figures 4.4 to 4.7, and an animation of each result.

    Args:
        results: The case study with and without secondary tasks, in any order.
        folder: Where the files go; made if missing.
        animation_frames: Frames of each result's GIF; 0 writes none.

    Returns:
        The files written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    for name, draw, size in (
        ("figure_4_4_path", _path, (5.0, 4.5)),
        ("figure_4_5_pose_error", _pose_error, (7.0, 3.2)),
        ("figure_4_6_joint_3", _joint_3, (7.0, 3.2)),
        ("figure_4_7_contacts", _contacts, (11.0, 3.4)),
    ):
        figure = Figure(figsize=size, layout="constrained")
        draw(figure, results)
        path = folder / f"{name}.png"
        drawn.append(style.save(figure, path))
    for result in results if animation_frames else ():
        suffix = "with_tasks" if result.with_tasks else "without_tasks"
        path = folder / f"case_study_{suffix}.gif"
        drawn.append(animate_case_study(result, path, frames=animation_frames))
    return tuple(drawn)


def write_histories(results: Sequence[CaseStudyResult], path: Path) -> Path:
    """Write all histories as one CSV file, a column each, with units in the names, 50 rows a second.

    The control steps between are left out: with them the file of the thesis' minute has 46 MB.

    Args:
        results: Results with the same control period.
        path: The file.
    """
    times = results[0].history.times
    every = max(round(1.0 / (_HISTORY_RATE_HZ * results[0].parameters.clik.step_s)), 1)
    kept = np.unique(np.append(np.arange(0, len(times), every), len(times) - 1))
    columns: dict[str, FloatArray] = {"time_s": times}
    for result in results:
        prefix = "with_tasks" if result.with_tasks else "without_tasks"
        desired = result.desired_positions
        columns |= {
            f"{prefix}.desired_x_m": desired[:, 0],
            f"{prefix}.desired_y_m": desired[:, 1],
            f"{prefix}.pose_error": result.pose_error,
            f"{prefix}.closed_chain_residual_m": result.closed_chain_residual_m,
            f"{prefix}.signed_distance_13_m": result.signed_distance_13_m,
            f"{prefix}.midpoint_distance_1_m": result.midpoint_distance_m[:, 0],
            f"{prefix}.midpoint_distance_3_m": result.midpoint_distance_m[:, 1],
        }
        for tip in range(4):
            columns[f"{prefix}.contact_{tip + 1}_x_m"] = result.contact_x_m[:, tip]
        for joint in range(result.history.joints.shape[1]):
            columns[f"{prefix}.q{joint + 1}_rad"] = result.history.joints[:, joint]
        for joint in range(result.joint_velocities.shape[1]):
            columns[f"{prefix}.dq{joint + 1}_rad_s"] = result.joint_velocities[:, joint]
        for k, name in enumerate(result.history.task_names):
            columns[f"{prefix}.activation_{name}"] = result.history.activations[:, k]
    path.parent.mkdir(parents=True, exist_ok=True)
    table = np.column_stack(list(columns.values()))[kept]
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")
    return path


def animate_case_study(
    result: CaseStudyResult, path: Path, *, frames: int = 90, frames_per_second: int = 15
) -> Path:
    """Write an animation (GIF) of the two grippers and the bar."""
    from matplotlib.animation import FuncAnimation, PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    chosen = np.linspace(0, len(result.history.times) - 1, frames).astype(int)
    arms = [arm_lines(result, k) for k in chosen]
    corners = np.concatenate([line for lines in arms for line in lines])
    figure = Figure(figsize=(5.6, 4.6))
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_xlim(corners[:, 0].min() - 0.3, corners[:, 0].max() + 0.3)
    axes.set_ylim(corners[:, 1].min() - 0.3, corners[:, 1].max() + 0.3)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.plot(*result.desired_positions[::20, :2].T, ":", color="0.6")
    colours = ["tab:blue"] * 3 + ["tab:orange"] * 3
    lines = [axes.plot([], [], "o-", color=colour, lw=2, ms=4)[0] for colour in colours]
    bar = axes.plot([], [], color="0.2", lw=5, alpha=0.6)[0]
    title = axes.set_title("")

    def draw(frame: int) -> list[Any]:
        for artist, line in zip(lines, arms[frame], strict=True):
            artist.set_data(line[:, 0], line[:, 1])
        k = chosen[frame]
        centre, rotation = (
            result.history.object_positions[k].mean(axis=0),
            result.history.object_rotations[k, 0],
        )
        half = 0.5 * result.parameters.bar_length_m * rotation[:, 0]
        ends = np.array([centre - half, centre + half])
        bar.set_data(ends[:, 0], ends[:, 1])
        title.set_text(f"{_STYLE[result.with_tasks][1]}, t = {result.history.times[k]:.1f} s")
        return [*lines, bar, title]

    path.parent.mkdir(parents=True, exist_ok=True)
    FuncAnimation(figure, draw, frames=frames, blit=False).save(
        path, writer=PillowWriter(fps=frames_per_second), dpi=80
    )
    return path


def arm_lines(result: CaseStudyResult, k: int) -> list[FloatArray]:
    """Return the links at a period as six polylines: arm and two branches of each gripper, (n, 2)."""
    system, _, _ = _system(result)
    state = system.state(result.history.joints[k], np.zeros_like(result.history.contact_variables[k]))
    origins, tips = state.joint_origins[:, :2].copy(), state.tip_positions[:, :2].copy()
    lines = []
    for g in range(2):
        first = 7 * g
        lines.append(origins[[first, first + 1, first + 2, first + 3]])
        for branch in range(2):
            joint = first + 3 + 2 * branch
            lines.append(np.vstack([origins[[joint, joint + 1]], tips[2 * g + branch]]))
    return lines


_SYSTEMS: dict[int, Any] = {}


def _system(result: CaseStudyResult) -> Any:
    key = id(result.parameters)
    if key not in _SYSTEMS:
        _SYSTEMS.clear()
        _SYSTEMS[key] = case_study_system(result.parameters)
    return _SYSTEMS[key]


def _path(figure: Any, results: Sequence[CaseStudyResult]) -> None:
    result = results[0]
    axes = figure.add_subplot()
    axes.plot(*result.desired_positions[:, :2].T, color="black")
    trajectory, p = case_study_path(result.parameters), result.parameters
    ends = np.cumsum([0.0] + [p.segment_s + p.pause_s] * 2)
    for label, time in zip("123", ends, strict=True):
        point = trajectory(float(time)).position
        axes.plot(*point[:2], "ko", ms=4)
        axes.annotate(label, point[:2], xytext=(5, 5), textcoords="offset points")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x (m)", ylabel="y (m)", title=_title("Path of the object"))


def _pose_error(figure: Any, results: Sequence[CaseStudyResult]) -> None:
    axes = figure.add_subplot()
    for result in results:
        dashes, label = _STYLE[result.with_tasks]
        axes.plot(result.history.times, result.pose_error, dashes, label=label)
    axes.set(xlabel="time (s)", ylabel="norm (m, rad)", title=_title("Pose error, mean of the four loops"))
    _legend(figure)


def _joint_3(figure: Any, results: Sequence[CaseStudyResult]) -> None:
    axes = figure.add_subplot()
    for result in results:
        dashes, label = _STYLE[result.with_tasks]
        axes.plot(result.history.times, result.q3, dashes, label=label)
    axes.axhline(np.pi / 2, color="0.5", lw=0.8)
    axes.set(xlabel="time (s)", ylabel="q3 (rad)", title=_title("Joint 3 and its limit"))
    _legend(figure)


def _contacts(figure: Any, results: Sequence[CaseStudyResult]) -> None:
    left, right = figure.subplots(1, 2)
    for result in results:
        dashes, label = _STYLE[result.with_tasks]
        left.plot(result.history.times, result.signed_distance_13_m, dashes, label=label)
        for tip in range(4):
            name = f"tip {tip + 1}" if result is results[0] else None
            right.plot(
                result.history.times, result.contact_x_m[:, tip], dashes, color=style.LINES[tip], label=name
            )
    left.axhline(0.3, color="0.5", lw=0.8)
    left.axhline(0.0, color="0.5", lw=0.8)
    left.set(xlabel="time (s)", ylabel="distance (m)", title="Signed distance from tip 1 to tip 3")
    right.set(xlabel="time (s)", ylabel="x (m)", title="Contacts from the centre of the object")
    _legend(figure)


def _title(text: str) -> str:
    return text if style.look().titles else ""


def _legend(figure: Any) -> None:
    """Put one legend of all curves under them, where it hides none."""
    figure.legend(loc="outside lower center", ncols=6, frameon=False, fontsize=9)
