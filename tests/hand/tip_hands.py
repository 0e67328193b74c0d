"""Hands whose last links have tips of several shapes, written by the tests."""

from pathlib import Path

import numpy as np
import trimesh

from graspbench.hand import FingerDescription, HandParameters, PalmDescription
from tests.hand.small_hands import INERTIAL, PALM, fingers, joint, link, written

BOX = '<box size="0.012 0.016 0.055"/>'
CYLINDER = '<cylinder radius="0.007" length="0.055"/>'
LENGTH = 0.055


def pad_mesh(path: Path) -> str:
    """Write a pad that is round on one side and flat on the other; return its geometry."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    points = ball.vertices * (0.008, 0.009, LENGTH / 2)
    points[:, 0] = np.maximum(points[:, 0], -0.004)
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.Trimesh(points, ball.faces).convex_hull.export(path)
    return f'<mesh filename="{path}"/>'


def finger(n: str, place: dict[str, str], geometry: str, *, last: str = "0 -1 0") -> str:
    """A finger of four joints whose last link is one shape of 55 mm."""
    tip = (
        f'<link name="{n}_d">{INERTIAL}<collision><origin xyz="0 0 {LENGTH / 2}"/>'
        f"<geometry>{geometry}</geometry></collision></link>"
    )
    return (
        joint(f"{n}1", "palm", f"{n}_a", "1 0 0", low=-0.6, high=0.6, **place)
        + link(f"{n}_a")
        + joint(f"{n}2", f"{n}_a", f"{n}_b", "0 -1 0", low=-1.2, high=1.0)
        + link(f"{n}_b", 0.06)
        + joint(f"{n}3", f"{n}_b", f"{n}_c", "0 -1 0", at="0 0 0.06", low=-0.2, high=1.6)
        + link(f"{n}_c", 0.04)
        + joint(f"{n}4", f"{n}_c", f"{n}_d", last, at="0 0 0.04", low=-0.8, high=1.4)
        + tip
    )


def tip_hand(folder: Path, geometry: str, count: int = 3, **options) -> HandParameters:
    """Write a hand and return its description: tips of one geometry, touched as they are."""
    path = written(folder / "hand.urdf", PALM + fingers(count, lambda n, at: finger(n, at, geometry)), "tips")
    chains = tuple(
        FingerDescription(
            name=n, tip=f"{n}_d", tip_xyz_m=(0.0, 0.0, 0.048), posture_deg=(0.0, -25.0, 30.0, 20.0)
        )
        for n in "fghij"[:count]
    )
    values = {"tip_shape": "link", "tip_radius_m": 0.008, "fingers": count} | options
    return HandParameters(
        name="tips", kind="urdf", urdf=str(path), palm=PalmDescription("palm"), chains=chains, **values
    )
