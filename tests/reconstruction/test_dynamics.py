"""The compiled motion against the equation of motion written out node by node."""

import numpy as np
import pytest

from graspbench.reconstruction import SurfaceParameters, VisualHull, build_network
from graspbench.reconstruction.dynamics import advance, energy, initial_state, law_of
from graspbench.reconstruction.preshaping import preshape
from graspbench.reconstruction.sampling import sample_ellipsoid
from tests.oracles.scenes import scene

READINGS = {
    "velocity_reset": SurfaceParameters(stiffness_n_per_m=5.0),
    "overdamped": SurfaceParameters(dynamics="overdamped", time_step_s=3.6e-8, stiffness_n_per_m=5.0),
    "damped": SurfaceParameters(dynamics="damped", damping_ns_per_m=1.6, stiffness_n_per_m=5.0),
}


def _start(parameters):
    shapes = scene("egg")
    hull = VisualHull(shapes.silhouettes)
    network = build_network(9, 8)
    ellipsoid = preshape(shapes.silhouettes, shapes.centre, parameters)
    return hull, network, shapes.centre, sample_ellipsoid(ellipsoid, network, 0.5)


def _plain(hull, network, centre, x, p, steps):
    """Integrate the equation of motion with no shortcut; return positions, speeds, crossings, alphas."""
    v, alpha = np.zeros_like(x), np.ones(len(x))
    crossings, inside = np.zeros(len(x), dtype=int), np.zeros(len(x), dtype=bool)
    for _ in range(steps):
        inwards = centre - x
        inwards /= np.linalg.norm(inwards, axis=1, keepdims=True)
        force = alpha[:, None] * p.pull_n * inwards
        for a in range(len(x)):
            linked = network.link_nodes[network.link_start[a] : network.link_start[a + 1]]
            force[a] -= p.stiffness_n_per_m * (len(linked) * x[a] - x[linked].sum(axis=0))
        if p.dynamics == "overdamped":
            v = force / p.damping_ns_per_m
        else:
            v = (v + p.time_step_s * force / p.mass_kg) / (1 + p.time_step_s * p.damping_ns_per_m / p.mass_kg)
        x = x + p.time_step_s * v
        crossed = hull.contains(x) != inside
        inside ^= crossed
        alpha[crossed] *= -p.pull_decay
        crossings += crossed
        if p.dynamics == "velocity_reset":
            v[crossed] = 0.0
    return x, v, crossings, alpha


@pytest.mark.parametrize("reading", READINGS)
def test_motion_follows_the_equation(reading):
    parameters = READINGS[reading]
    hull, network, centre, start = _start(parameters)
    state, law = initial_state(start, len(hull.silhouettes)), law_of(parameters)
    steps = 150 if reading == "damped" else 30
    done = advance(state, law, hull.fields, network.link_start, network.link_nodes, centre, steps)
    x, v, crossings, alpha = _plain(hull, network, centre, start, parameters, done)
    assert crossings.max() > 2
    np.testing.assert_array_equal(state.crossings, crossings)
    np.testing.assert_allclose(state.pulls, alpha)
    np.testing.assert_allclose(state.points, x, atol=1e-9)
    np.testing.assert_allclose(state.velocities, v, atol=1e-6)


def test_energy_is_that_of_masses_and_springs():
    parameters = READINGS["velocity_reset"]
    hull, network, centre, start = _start(parameters)
    state, law = initial_state(start, len(hull.silhouettes)), law_of(parameters)
    advance(state, law, hull.fields, network.link_start, network.link_nodes, centre, 7)
    pairs = {
        tuple(sorted((a, int(b))))
        for a in range(network.size)
        for b in network.link_nodes[network.link_start[a] : network.link_start[a + 1]]
    }
    springs = sum(np.sum((state.points[a] - state.points[b]) ** 2) for a, b in pairs)
    expected = 0.5 * 1e-3 * np.sum(state.velocities**2) + 0.5 * 5.0 * springs
    assert energy(state, law, network.link_start, network.link_nodes) == pytest.approx(expected)
