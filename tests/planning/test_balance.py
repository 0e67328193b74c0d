"""The imbalance of a grasp, against the forces of the field one by one."""

from itertools import combinations, product

import numpy as np
import pytest

from graspbench.grasp.quality import QualityParameters
from graspbench.planning.balance import imbalance, propose_balance
from graspbench.planning.grip_plane import grip_geometry
from graspbench.planning.index import free_moves, make_index
from graspbench.planning.indices.force_field import ForceFieldParameters, field_forces
from tests.planning.shapes import ellipsoid, radial

LENGTH_M, ANGLE_DEG = 0.1, 60.0


def waved(d):
    return 0.04 * (1 + 0.1 * np.cos(3 * np.arctan2(d[:, 1], d[:, 0])) * (1 - d[:, 2] ** 2) + 0.1 * d[:, 0])


SURFACE = radial(waved, meridians=24, parallels=17)


def coefficients(k_pi=1.0, k_cm=1.0, k_e=1.0, k_a=1.0, k_r_per_m=0.0):
    return np.array([k_pi / LENGTH_M, k_cm / LENGTH_M, k_e / np.deg2rad(ANGLE_DEG), k_a, k_r_per_m])


def left_of_the_forces(points, normals, centroid, k):
    """What the module's formula says, from the force field's terms."""
    parameters = ForceFieldParameters(
        k_pi=k[0] * LENGTH_M, k_cm=k[1] * LENGTH_M, k_e=k[2] * np.deg2rad(ANGLE_DEG), k_a=k[3],
        length_unit_m=LENGTH_M, angle_unit_deg=ANGLE_DEG,
    )  # fmt: skip
    forces = field_forces(points, normals, centroid, parameters)

    def tangential(force):
        return np.linalg.norm(force - (force * normals).sum(axis=1, keepdims=True) * normals, axis=1)

    errors = tangential(forces.plane) + tangential(forces.centroid) + tangential(forces.equilateral)
    area = grip_geometry(points, centroid).area_m2
    return tangential(forces.area).max() + errors.mean() - k[4] * np.sqrt(area)


@pytest.mark.parametrize("n_f", [3, 4, 5])
def test_is_what_is_left_of_each_projected_force(n_f):
    random = np.random.default_rng(n_f)
    for _ in range(20):
        angles = 2 * np.pi * (np.arange(n_f) + random.uniform(-0.2, 0.2, n_f)) / n_f
        outwards = np.column_stack([np.cos(angles), np.sin(angles), random.uniform(-0.2, 0.2, n_f)])
        points = outwards * random.uniform(0.02, 0.05, (n_f, 1))
        normals = outwards + random.uniform(-0.3, 0.3, (n_f, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        centroid = random.uniform(-0.002, 0.002, 3)
        k = coefficients(*random.uniform(0.2, 2.0, 4), k_r_per_m=random.uniform(0, 30))
        found = imbalance(points, normals, centroid, k)
        assert found == pytest.approx(left_of_the_forces(points, normals, centroid, k), rel=1e-9)


@pytest.mark.parametrize("n_f", [2, 3, 4])
def test_nothing_is_left_of_an_equilateral_grasp_of_a_sphere(n_f):
    angles = 2 * np.pi * np.arange(n_f) / n_f
    normals = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    assert imbalance(0.03 * normals, normals, np.zeros(3), coefficients()) == pytest.approx(0.0, abs=1e-7)
    # Normals the other way: the push outwards is balanced nowhere.
    assert imbalance(0.03 * normals, -normals, np.zeros(3), coefficients()) == pytest.approx(2.0)


def test_takes_the_best_single_move_and_a_pair_only_where_none_helps():
    k, kinds = coefficients(k_r_per_m=3.0 / 0.04), set()
    random = np.random.default_rng(1)

    def value(vertices):
        return imbalance(SURFACE.points[vertices], SURFACE.normals[vertices], SURFACE.centroid, k)

    for _ in range(25):
        vertices = random.choice(len(SURFACE.points), 3, replace=False)
        for _ in range(40):
            moves = free_moves(SURFACE, vertices)
            best = {}
            for size in (1, 2):
                options = [vertices]
                for fingers in combinations(range(3), size):
                    for nodes in product(*(moves.nodes[i, 1:][moves.nodes[i, 1:] >= 0] for i in fingers)):
                        other = vertices.copy()
                        other[list(fingers)] = nodes
                        if len(set(other.tolist())) == 3:
                            options.append(other)
                best[size] = min(value(option) for option in options)
            here, proposed = value(vertices), vertices.copy()
            moved = propose_balance(
                SURFACE.points, SURFACE.normals, SURFACE.centroid, moves.nodes, moves.barrier, k, proposed
            )
            size = 1 if best[1] < here - 1e-8 else 2
            if not moved:
                assert best[2] >= here - 1e-8
                break
            kinds.add(size)
            assert value(proposed) == pytest.approx(best[size], abs=1e-12)
            vertices = proposed
    assert kinds == {1, 2}


def test_the_barrier_deflects_a_move():
    k = coefficients()
    vertices = np.array([40, 200, 310])
    moves = free_moves(SURFACE, vertices)
    free = vertices.copy()
    assert propose_balance(
        SURFACE.points, SURFACE.normals, SURFACE.centroid, moves.nodes, moves.barrier, k, free
    )
    barrier = moves.barrier.copy()
    barrier[:, 1:][moves.nodes[:, 1:] == free[:, None]] = 0.5
    deflected = vertices.copy()
    propose_balance(SURFACE.points, SURFACE.normals, SURFACE.centroid, moves.nodes, barrier, k, deflected)
    assert deflected.tolist() != free.tolist()


def test_size_counts_only_where_moments_do():
    """On an ellipsoid: the largest polygon with moments, with forces alone any balanced grasp."""
    surface = ellipsoid((0.03, 0.034, 0.06))
    vertices = np.array([700, 713, 726])
    small = ellipsoid((0.02, 0.024, 0.05))
    with_moments = make_index("force_field", ForceFieldParameters(), 3, QualityParameters())
    force_only = make_index(
        "force_field", ForceFieldParameters(), 3, QualityParameters(wrench_space="planar_force")
    )
    assert with_moments.score(surface, vertices) - force_only.score(surface, vertices) > 1.0
    given = make_index("force_field", ForceFieldParameters(k_r=0.0), 3, QualityParameters())
    assert given.score(small, vertices) == force_only.score(small, vertices)
