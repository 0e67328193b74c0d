"""Small hands of several kinds, written by the tests."""

from pathlib import Path

import numpy as np

INERTIAL = (
    '<inertial><mass value="0.03"/>'
    '<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>'
)
PALM = (
    f'<link name="palm">{INERTIAL}<collision><origin xyz="0 0 -0.01"/>'
    '<geometry><cylinder radius="0.05" length="0.02"/></geometry></collision></link>'
)
LIMIT = '<limit lower="{low}" upper="{high}" effort="3" velocity="4"/>'


def link(name: str, length: float = 0.0, ball: bool = False) -> str:
    shape = ""
    if length:
        shape = (
            f'<collision><origin xyz="0 0 {length / 2}"/><geometry>'
            f'<cylinder radius="0.006" length="{length}"/></geometry></collision>'
        )
    if ball:
        sphere = '<geometry><sphere radius="0.009"/></geometry>'
        shape += f'<collision><origin xyz="0 0 {length}"/>{sphere}</collision>'
    return f'<link name="{name}">{INERTIAL}{shape}</link>'


def joint(
    name: str,
    parent: str,
    child: str,
    axis: str,
    *,
    at: str = "0 0 0",
    rpy: str = "0 0 0",
    low: float = -1.4,
    high: float = 1.4,
    kind: str = "revolute",
    mimic: str = "",
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{at}" rpy="{rpy}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/>{LIMIT.format(low=low, high=high)}{mimic}</joint>'
    )


def written(path: Path, body: str, name: str = "small") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<robot name="{name}">{body}</robot>')
    return path


def fingers(count: int, finger: "object") -> str:
    """Return ``finger(n, place)`` for fingers spread around the palm, n a letter."""
    text = ""
    for k in range(count):
        angle = 2 * np.pi * k / count
        place = {"at": f"{0.05 * np.cos(angle):.9f} {0.05 * np.sin(angle):.9f} 0", "rpy": f"0 0 {angle:.9f}"}
        text += finger("fghij"[k], place)  # type: ignore[operator]
    return text


def three_joints(n: str, place: dict[str, str], *, ball: bool = False, sideways: str = "1 0 0") -> str:
    return (
        joint(f"{n}1", "palm", f"{n}_a", sideways, low=-0.6, high=0.6, **place)
        + link(f"{n}_a")
        + joint(f"{n}2", f"{n}_a", f"{n}_b", "0 -1 0", low=-0.8, high=1.0)
        + link(f"{n}_b", 0.07)
        + joint(f"{n}3", f"{n}_b", f"{n}_c", "0 -1 0", at="0 0 0.07", low=-0.2, high=1.6)
        + link(f"{n}_c", 0.055, ball)
    )


def one_joint_coupled(n: str, place: dict[str, str]) -> str:
    """A finger of one joint and one that follows it, with an offset."""
    follows = f'<mimic joint="{n}1" multiplier="0.8" offset="0.3"/>'
    return (
        joint(f"{n}1", "palm", f"{n}_a", "0 -1 0", low=-0.6, high=1.0, **place)
        + link(f"{n}_a", 0.06)
        + joint(f"{n}2", f"{n}_a", f"{n}_b", "0 -1 0", at="0 0 0.06", low=-0.4, high=1.4, mimic=follows)
        + link(f"{n}_b", 0.045)
    )


def two_joints(n: str, place: dict[str, str]) -> str:
    return (
        joint(f"{n}1", "palm", f"{n}_a", "0 -1 0", low=-0.6, high=1.0, **place)
        + link(f"{n}_a", 0.06)
        + joint(f"{n}2", f"{n}_a", f"{n}_b", "0 -1 0", at="0 0 0.06", low=-0.2, high=1.4)
        + link(f"{n}_b", 0.045)
    )


def parallel_gripper(path: Path) -> Path:
    """Two sliding fingers, the right one follows the left one."""
    body = PALM
    for n, sign, mimic in (("left", 1, ""), ("right", -1, '<mimic joint="left_slide"/>')):
        body += joint(
            f"{n}_slide",
            "palm",
            f"{n}_finger",
            f"{sign} 0 0",
            low=0.0,
            high=0.05,
            kind="prismatic",
            mimic=mimic,
        )
        body += (
            f'<link name="{n}_finger">{INERTIAL}<collision><origin xyz="{sign * 0.006} 0 0.04"/>'
            '<geometry><box size="0.012 0.016 0.08"/></geometry></collision></link>'
        )
    return written(path, body, "gripper")
