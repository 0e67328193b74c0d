"""A picture of a hand: open, and closed around the object its posture is for, with palm and tip frames."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.report import style
from graspbench.report.hand_solids import hand_solids
from graspbench.report.render import Viewpoint, render
from graspbench.report.solids import Rgb, Solid, ball, tube

if TYPE_CHECKING:
    from graspbench.hand.model import HandModel

_TILE = 420
_AXES: tuple[Rgb, ...] = ((0.85, 0.15, 0.10), (0.10, 0.60, 0.15), (0.10, 0.30, 0.85))
_POINT = 0.2  # of half a fingertip's width: how large a point where a link touches is drawn
_TIP: Rgb = (0.90, 0.62, 0.00)
_UPRIGHT = np.diag([1.0, -1.0, -1.0, 1.0])  # the approach direction points down


def draw_hand(hand: "HandModel", path: Path) -> Path:
    """Draw a hand open and closed, each from two sides.

    Args:
        hand: The hand.
        path: PNG file to write.
    """
    postures = (("open (at rest)", hand.rest), ("closed (preferred posture)", hand.preferred))
    bodies = [hand_solids(hand, joints, _UPRIGHT) for _, joints in postures]
    cloud = np.concatenate([solid.points for solids in bodies for solid in solids])
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    centre = 0.5 * (low + high)
    radius = 1.05 * float(np.linalg.norm(cloud - centre, axis=1).max())
    head = 66
    figure = style.canvas(4 * _TILE, _TILE + head + 34)
    tile = 0
    for (label, joints), solids in zip(postures, bodies, strict=True):
        marks = [*_frame(np.eye(4), 0.35 * radius), *_tips(hand, joints)]
        for azimuth in (-60.0, 30.0):
            view = Viewpoint(centre, azimuth, 15.0, radius)
            image = render(list(solids), marks, view, (_TILE, _TILE), ghost=0.6)
            style.place(figure, image, tile * _TILE, head, (_TILE, _TILE))
            if azimuth < 0:
                style.write(figure, label, (tile + 1) * _TILE, _TILE + head + 4, 12, ha="center")
            tile += 1
    names = ", ".join(hand.finger_names)
    tips = (
        "links that touch as they are" if hand.tips_are_links else f"tips of {1e3 * hand.tip_radius_m:.1f} mm"
    )
    said = f"{hand.name}: fingers {names}, {tips}"
    style.write(figure, said, 18, 12, 14, weight="bold")
    caption = "palm frame: x red, y green, z blue (approach, down here); orange: the fingertips in use"
    style.write(figure, caption, 18, 40, 12)
    scale = Viewpoint(centre, 0.0, 15.0, radius).pixels_per_m(_TILE, _TILE)
    style.scale_bar(figure, scale, 4 * _TILE - 16, head + _TILE - 8)
    path.parent.mkdir(parents=True, exist_ok=True)
    return style.save(figure, path)


def _frame(pose: FloatArray, length: float) -> list[Solid]:
    to_world = _UPRIGHT @ pose
    origin = to_world[:3, 3]
    return [
        tube(np.stack((origin, origin + length * to_world[:3, i])), 0.02 * length, color)
        for i, color in enumerate(_AXES)
    ]


def _tips(hand: "HandModel", joints: FloatArray) -> list[Solid]:
    centres = hand.tip_positions(joints) @ _UPRIGHT[:3, :3].T
    radius = _POINT * hand.pad_radius_m if hand.tips_are_links else hand.tip_radius_m
    return [ball(centre, radius, _TIP) for centre in centres]
