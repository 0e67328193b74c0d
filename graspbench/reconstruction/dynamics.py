"""The equation of motion of the reconstruction surface, compiled (thesis 3.3.2)."""

from typing import NamedTuple

import numpy as np
from numba import njit

from graspbench.arrays import BoolArray, FloatArray, IntArray
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.visual_hull import HullFields, excluding_view, hull_distance

VELOCITY_RESET, OVERDAMPED, DAMPED = range(3)
READINGS = {"velocity_reset": VELOCITY_RESET, "overdamped": OVERDAMPED, "damped": DAMPED}


class Law(NamedTuple):
    """Constants of the equation of motion; see `SurfaceParameters` for their meaning."""

    reading: int
    mass: float
    stiffness: float
    damping: float
    pull: float
    decay: float
    step: float
    rest_step: float
    rest_count: int


class State(NamedTuple):
    """What changes while the surface moves; all arrays are written in place.

    Attributes:
        points: Node positions, shape (n_s, 3).
        velocities: Node velocities, shape (n_s, 3).
        forces: Work space, shape (n_s, 3).
        pulls: Scale alpha of each node's pull, shape (n_s,).
        crossings: How often each node crossed the hull's border, shape (n_s,).
        excluders: View that excluded the node last, n_img for the ground, -1 when inside, shape (n_s,).
        before: Positions before each node's last crossing, shape (n_s, 3).
        after: Positions after each node's last crossing, shape (n_s, 3).
        quiet: Number of small steps in a row, shape (1,).
        largest_step: Largest motion of a node in the last step, shape (1,).
    """

    points: FloatArray
    velocities: FloatArray
    forces: FloatArray
    pulls: FloatArray
    crossings: IntArray
    excluders: IntArray
    before: FloatArray
    after: FloatArray
    quiet: IntArray
    largest_step: FloatArray


def law_of(parameters: SurfaceParameters) -> Law:
    """Return the constants of the equation of motion."""
    return Law(
        READINGS[parameters.dynamics],
        parameters.mass_kg,
        parameters.stiffness_n_per_m,
        parameters.damping_ns_per_m,
        parameters.pull_n,
        parameters.pull_decay,
        parameters.time_step_s,
        parameters.rest_step_m,
        parameters.rest_count,
    )


def initial_state(points: FloatArray) -> State:
    """Return the state of nodes at rest outside the hull."""
    size = len(points)
    return State(
        points.copy(),
        np.zeros((size, 3)),
        np.zeros((size, 3)),
        np.ones(size),
        np.zeros(size, dtype=np.int64),
        np.zeros(size, dtype=np.int64),
        points.copy(),
        points.copy(),
        np.zeros(1, dtype=np.int64),
        np.zeros(1),
    )


@njit(cache=True, nogil=True)  # type: ignore[misc]
def advance(
    state: State,
    law: Law,
    fields: HullFields,
    link_start: IntArray,
    link_nodes: IntArray,
    centre: FloatArray,
    steps: int,
) -> int:
    """Integrate up to ``steps`` steps; stop when the surface is at rest.

    Every node feels its springs, its damper and the pull alpha F_a towards the centre. When it
    crosses the hull's border, alpha changes its sign and shrinks.

    Returns:
        The number of steps done.
    """
    for k in range(steps):
        _sum_forces(state, law, link_start, link_nodes, centre)
        state.largest_step[0] = np.sqrt(_move(state, law, fields))
        if state.largest_step[0] < law.rest_step and state.crossings.min() > 0:
            state.quiet[0] += 1
            if state.quiet[0] >= law.rest_count:
                return k + 1
        else:
            state.quiet[0] = 0
    return steps


@njit(cache=True)  # type: ignore[misc]
def _sum_forces(
    state: State, law: Law, link_start: IntArray, link_nodes: IntArray, centre: FloatArray
) -> None:
    points, forces = state.points, state.forces
    for a in range(len(points)):
        x, y, z = points[a, 0], points[a, 1], points[a, 2]
        tx, ty, tz = centre[0] - x, centre[1] - y, centre[2] - z
        distance = np.sqrt(tx * tx + ty * ty + tz * tz)
        scale = state.pulls[a] * law.pull / distance if distance > 0.0 else 0.0
        sx = sy = sz = 0.0
        for k in range(link_start[a], link_start[a + 1]):
            b = link_nodes[k]
            sx += points[b, 0] - x
            sy += points[b, 1] - y
            sz += points[b, 2] - z
        forces[a, 0] = scale * tx + law.stiffness * sx
        forces[a, 1] = scale * ty + law.stiffness * sy
        forces[a, 2] = scale * tz + law.stiffness * sz


@njit(cache=True)  # type: ignore[misc]
def _move(state: State, law: Law, fields: HullFields) -> float:
    """Take one semi-implicit Euler step; return the square of its largest motion."""
    points, velocities = state.points, state.velocities
    outside = len(fields.starts)
    inverse = 1.0 / (1.0 + law.step * law.damping / law.mass)
    largest = 0.0
    for a in range(len(points)):
        for k in range(3):
            if law.reading == OVERDAMPED:
                velocities[a, k] = state.forces[a, k] / law.damping
            else:
                velocities[a, k] = (velocities[a, k] + law.step * state.forces[a, k] / law.mass) * inverse
        dx, dy, dz = law.step * velocities[a, 0], law.step * velocities[a, 1], law.step * velocities[a, 2]
        x, y, z = points[a, 0] + dx, points[a, 1] + dy, points[a, 2] + dz
        largest = max(largest, dx * dx + dy * dy + dz * dz)
        was = state.excluders[a]
        now = excluding_view(fields, x, y, z, was if was >= 0 else outside)
        if (now < 0) != (was < 0):
            state.before[a] = points[a]
            state.after[a, 0], state.after[a, 1], state.after[a, 2] = x, y, z
            state.pulls[a] *= -law.decay
            state.crossings[a] += 1
            if law.reading == VELOCITY_RESET:
                velocities[a] = 0.0
        state.excluders[a] = now
        points[a, 0], points[a, 1], points[a, 2] = x, y, z
    return largest


@njit(cache=True, nogil=True)  # type: ignore[misc]
def settle(state: State, fields: HullFields) -> None:
    """Put each node where the hull's border cuts its last crossing (regula falsi)."""
    for a in range(len(state.points)):
        p, q = state.before[a], state.after[a]
        low = hull_distance(fields, p[0], p[1], p[2])
        high = hull_distance(fields, q[0], q[1], q[2])
        s, t = 0.0, 1.0
        for _ in range(3):
            if low == high:
                break
            m = s + (t - s) * low / (low - high)
            x = p[0] + m * (q[0] - p[0])
            y = p[1] + m * (q[1] - p[1])
            z = p[2] + m * (q[2] - p[2])
            state.points[a, 0], state.points[a, 1], state.points[a, 2] = x, y, z
            value = hull_distance(fields, x, y, z)
            if (value < 0.0) == (low < 0.0):
                s, low = m, value
            else:
                t, high = m, value


@njit(cache=True, nogil=True)  # type: ignore[misc]
def energy(state: State, law: Law, link_start: IntArray, link_nodes: IntArray) -> float:
    """Return the kinetic energy of the nodes and the elastic energy of the links (J)."""
    kinetic = 0.0
    stretch = 0.0
    points = state.points
    for a in range(len(points)):
        for k in range(3):
            kinetic += state.velocities[a, k] ** 2
            for link in range(link_start[a], link_start[a + 1]):
                stretch += (points[link_nodes[link], k] - points[a, k]) ** 2
    # Every link was met from both its ends.
    return 0.5 * law.mass * kinetic + 0.25 * law.stiffness * stretch
