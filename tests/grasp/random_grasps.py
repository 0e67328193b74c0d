"""Random grasps whose wrenches the oracles can build from the definition."""

import numpy as np

from graspbench.grasp import grasp_quality, is_force_closure

MODELS = ("frictionless", "hard_finger", "soft_finger", "soft_pad")
SPACES = ("spatial", "planar", "spatial_force", "planar_force")


def random_grasp(rng, model, space):
    """Return points, normals and tangents; in the plane z = 0 for planar spaces."""
    needed = {"spatial": 7, "planar": 4, "spatial_force": 4, "planar_force": 3}[space]
    n_f = needed + int(rng.integers(2)) if model == "frictionless" else int(rng.integers(2, 4))
    points = rng.standard_normal((n_f, 3))
    if space.startswith("planar"):
        points[:, 2] = 0.0
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    normals = -points + 0.3 * rng.standard_normal((n_f, 3))
    points = points * rng.uniform(0.6, 1.4, (n_f, 1))
    tangents = rng.standard_normal((n_f, 3))
    if space.startswith("planar"):
        normals[:, 2] = 0.0
        tangents = np.cross([0.0, 0.0, 1.0], normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tangents -= np.sum(tangents * normals, axis=1, keepdims=True) * normals
    return points, normals, tangents / np.linalg.norm(tangents, axis=1, keepdims=True)


def measured(grasp, model, space, *, friction=0.6, edges=4, torsion=0.2, torque_length=1.3, norm="l1"):
    """Return the package's quality and its force closure test."""
    points, normals, tangents = grasp
    options = {
        "contact": model, "wrench_space": space, "friction": friction, "cone_edges": edges,
        "torsional_friction": torsion, "torque_length": torque_length, "tangents": tangents,
    }  # fmt: skip
    return (
        grasp_quality(points, normals, np.zeros(3), norm=norm, **options),
        is_force_closure(points, normals, np.zeros(3), **options),
    )
