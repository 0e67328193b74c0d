"""Hands, charts and systems that several test modules share."""

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.manipulation import charts
from graspbench.manipulation.kinematic_tree import KinematicTree


def random_tree(rng, fingers=4, joints=4, shared=1):
    """A hand of ``fingers`` serial fingers of ``joints`` joints that share ``shared`` more."""
    parents, tips = list(range(-1, shared - 1)), []
    for _ in range(fingers):
        parents.append(shared - 1)
        parents += list(range(len(parents) - 1, len(parents) + joints - 2))
        tips.append(len(parents) - 1)
    n = len(parents)
    axes = rng.normal(size=(n, 3))
    return KinematicTree(
        np.array(parents),
        Rotation.random(n, rng=rng).as_matrix(),
        rng.uniform(-0.1, 0.1, (n, 3)),
        axes / np.linalg.norm(axes, axis=1)[:, None],
        np.array(tips),
        Rotation.random(fingers, rng=rng).as_matrix(),
        rng.uniform(-0.1, 0.1, (fingers, 3)),
    )


def bumpy_points(rng):
    """Vertices of a smooth bumpy sphere, radius about 50 mm."""
    direction = rng.normal(size=(4000, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    radius = 0.05 * (1.0 + 0.1 * np.sin(3 * direction[:, 0]) * direction[:, 1])
    return direction * radius[:, None]


def all_charts():
    """Every kind of chart, each away from the origin and turned, with a box of regular coordinates."""
    rotation = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    origin = np.array([0.02, -0.03, 0.01])
    place = {"rotation": rotation, "origin": origin}
    points = bumpy_points(np.random.default_rng(5))
    top = points[np.argmax(points[:, 0])]
    profile = [0.03, 0.04, 0.035, 0.045, 0.02]
    return {
        "plane": (charts.plane(**place), (-0.1, 0.1), (-0.1, 0.1)),
        "sphere": (charts.sphere(0.05, towards=[1, 2, 3], origin=origin), (-2.0, 2.0), (-1.0, 1.0)),
        "ellipsoid": (charts.ellipsoid([0.04, 0.07, 0.05], **place), (0.3, 2.8), (-1.0, 1.0)),
        "oblate": (charts.ellipsoid([0.07, 0.07, 0.05], **place), (-2.0, 2.0), (-1.0, 1.0)),
        "prolate": (charts.ellipsoid([0.07, 0.05, 0.05], **place), (0.3, 2.8), (-1.0, 1.0)),
        "cylinder": (charts.cylinder(0.04, **place), (-2.0, 2.0), (-0.1, 0.1)),
        "revolution": (charts.revolution(profile, np.linspace(0, 0.1, 5), **place), (-2, 2), (0.05, 0.95)),
        "mesh": (charts.mesh_patch(points, top, top / np.linalg.norm(top)), (-0.01, 0.01), (-0.01, 0.01)),
    }


CHARTS = all_charts()


def turn_between(before, after):
    """Rotation vector that takes one orientation to another, base frame."""
    return Rotation.from_matrix(after @ before.T).as_rotvec()
