"""Boxes held by random fingers, with plane contacts at chosen places."""

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.manipulation import charts
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem
from graspbench.manipulation.kinematic_tree import KinematicTree


def box_hand(points, normals, kind, joints=3, seed=0):
    """Fingers of ``joints`` random joints each whose tips sit on plane faces at the given points."""
    rng = np.random.default_rng(seed)
    n = len(points)
    parents = np.array([k - 1 if k % joints else -1 for k in range(n * joints)])
    axes = rng.normal(size=(n * joints, 3))
    tree = KinematicTree(
        parents,
        Rotation.random(n * joints, rng=rng).as_matrix(),
        rng.uniform(-0.1, 0.1, (n * joints, 3)),
        axes / np.linalg.norm(axes, axis=1)[:, None],
        np.arange(n) * joints + joints - 1,
        np.tile(np.eye(3), (n, 1, 1)),
        rng.uniform(-0.1, 0.1, (n, 3)),
    )
    q = rng.uniform(-1, 1, n * joints)
    faces = []
    for point, normal in zip(points, normals, strict=True):
        rotation = Rotation.align_vectors([normal], [[0.0, 0.0, 1.0]])[0].as_matrix()
        faces.append(Contact(charts.plane(rotation=rotation, origin=np.array(point)), kind))
    probe = ManipulationSystem(tree, faces).state(q, np.zeros((n, 5)))
    # carry every finger so that its tip meets the box, which sits at the base frame
    translations = tree.placement_translations.copy()
    for i in range(n):
        translations[i * joints] += np.array(points[i]) - probe.tip_positions[i]
    moved = KinematicTree(
        tree.parents, tree.placement_rotations, translations, tree.axes,
        tree.tip_joints, tree.tip_rotations, tree.tip_translations,
    )  # fmt: skip
    system, variables = ManipulationSystem(moved, faces).grasped(q, np.zeros(3), np.eye(3))
    return system.state(q, variables)


OPPOSITE = [[0.05, 0.01, 0.0], [-0.05, 0.01, 0.0]], [[1.0, 0, 0], [-1.0, 0, 0]]
TRIPOD = [[0.05, 0.0, 0.0], [-0.05, 0.02, 0.0], [0.0, 0.05, 0.01]], [[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0]]
