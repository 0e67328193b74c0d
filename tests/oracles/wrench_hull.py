"""Grasp wrench spaces from their definition, and the ball in them by brute force."""

from itertools import combinations, product

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull


def corner_wrenches(points, normals, tangents, model, space, friction, edges, torsion, torque_length):
    """Return each contact's corner wrenches about the origin; planar ones are in the plane z = 0."""
    contacts = []
    for p, n, t in zip(points, normals, tangents, strict=True):
        corners = []
        count = 1 if model == "frictionless" else edges
        for k, (share, twist) in product(range(count), _sides(model, edges, torsion)):
            angle = 2.0 * np.pi * k / count
            radius = 0.0 if model == "frictionless" else share * friction
            force = n + radius * (np.cos(angle) * t + np.sin(angle) * np.cross(n, t))
            corners.append(np.concatenate([force, np.cross(p, force) / torque_length + twist * n]))
        rows = {"spatial": range(6), "planar": (0, 1, 5), "spatial_force": range(3), "planar_force": (0, 1)}
        contacts.append(np.array(corners)[:, list(rows[space])])
    return contacts


def _sides(model, edges, torsion):
    """Return the corners above an edge of the cone: share of the sideways force, and twist."""
    if model == "soft_finger":
        return (1.0, -torsion), (1.0, torsion)
    if model != "soft_pad":
        return ((1.0, 0.0),)
    levels = max(1, round(edges / 4))
    angles = 0.5 * np.pi * np.arange(-levels, levels + 1) / levels
    return tuple(zip(np.cos(angles), torsion * np.sin(angles), strict=True))


def ball_by_subsets(contacts):
    """Return the radius of the ball in the hull of the union, from all sets of d corners."""
    w = np.concatenate(contacts)
    n, d = w.shape
    if n <= d or np.linalg.matrix_rank(w[1:] - w[0], tol=1e-9) < d:
        return 0.0
    subsets = np.array(list(combinations(range(n), d)))
    rows = np.concatenate([w[subsets], np.ones((len(subsets), d, 1))], axis=2)
    _, sizes, axes = np.linalg.svd(rows)
    normals = axes[sizes[:, -1] > 1e-9, -1, :d]
    normals = normals[np.linalg.norm(normals, axis=1) > 1e-9]
    heights = (normals / np.linalg.norm(normals, axis=1, keepdims=True)) @ w.T
    return max(0.0, float(min(heights.max(axis=1).min(), (-heights).max(axis=1).min())))


def ball_by_hull(contacts, minkowski):
    """Return the ball's radius by Qhull, from the corners of the union or of the Minkowski sum."""
    if minkowski:
        with_rest = [np.vstack([np.zeros(w.shape[1]), w]) for w in contacts]
        w = np.array([np.sum(choice, axis=0) for choice in product(*with_rest)])
    else:
        w = np.concatenate(contacts)
    if len(w) <= w.shape[1] or np.linalg.matrix_rank(w[1:] - w[0], tol=1e-9) < w.shape[1]:
        return 0.0
    return max(0.0, float(-ConvexHull(w).equations[:, -1].max()))


def closure_by_lp(contacts):
    """Tell by a linear program whether positive weights of spanning corner wrenches balance to nothing."""
    w = np.concatenate(contacts)
    if np.linalg.matrix_rank(w, tol=1e-9) < w.shape[1]:
        return False
    weights = linprog(
        np.zeros(len(w)), A_eq=w.T, b_eq=np.zeros(w.shape[1]), bounds=(1.0, None), method="highs"
    )
    return weights.status == 0
