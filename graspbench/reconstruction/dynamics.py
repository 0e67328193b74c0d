"""The equation of motion of the reconstruction surface, compiled (thesis 3.3.2)."""

from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.reconstruction.hull_fields import HullFields, critical_view, view_distance
from graspbench.reconstruction.parameters import SurfaceParameters

VELOCITY_RESET, OVERDAMPED, DAMPED = range(3)
SETTLED_M = 1e-6

SLACK = 0.8
"""Share of the distance in the images that a node may surely go: perspective stretches distances."""

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
        crossed: The view whose border each node crossed last, shape (n_s,).
        excluder: The view that excludes each node, n_img for the ground, -1 inside the hull, shape (n_s,).
        way: Length of each node's path so far (m), shape (n_s,).
        due: Path length at which the node's side of the hull's border must be looked up, shape (n_s,).
        rest_due: The same for all views but the one that excludes the node or that it crossed last,
            0 where unknown, shape (n_s,).
        view_due: The same for each single view's border, shape (n_s, n_img + 1).
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
    crossed: IntArray
    excluder: IntArray
    way: FloatArray
    due: FloatArray
    rest_due: FloatArray
    view_due: FloatArray
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


def initial_state(points: FloatArray, views: int) -> State:
    """Return the state of nodes at rest outside the hull of a number of views."""
    size = len(points)
    return State(
        points.copy(),
        np.zeros((size, 3)),
        np.zeros((size, 3)),
        np.ones(size),
        np.zeros(size, dtype=np.int64),
        np.zeros(size, dtype=np.int64),
        np.zeros(size, dtype=np.int64),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros((size, views + 1)),
        points.copy(),
        points.copy(),
        np.zeros(1, dtype=np.int64),
        np.zeros(1),
    )


@compiled
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
        if state.largest_step[0] < law.rest_step and _all_crossed(state.crossings):
            state.quiet[0] += 1
            if state.quiet[0] >= law.rest_count:
                return k + 1
        else:
            state.quiet[0] = 0
    return steps


@inner
def _all_crossed(crossings: IntArray) -> bool:
    for count in crossings:  # noqa: SIM110 - compiled
        if count == 0:
            return False
    return True


@inner
def _sum_forces(
    state: State, law: Law, link_start: IntArray, link_nodes: IntArray, centre: FloatArray
) -> None:
    points, forces = state.points, state.forces
    cx, cy, cz = centre[0], centre[1], centre[2]
    for a in range(len(points)):
        x, y, z = points[a, 0], points[a, 1], points[a, 2]
        tx, ty, tz = cx - x, cy - y, cz - z
        distance = np.sqrt(tx * tx + ty * ty + tz * tz)
        scale = state.pulls[a] * law.pull / distance if distance > 0.0 else 0.0
        sx = sy = sz = 0.0
        if law.stiffness > 0.0:
            for k in range(link_start[a], link_start[a + 1]):
                b = link_nodes[k]
                sx += points[b, 0] - x
                sy += points[b, 1] - y
                sz += points[b, 2] - z
        forces[a, 0] = scale * tx + law.stiffness * sx
        forces[a, 1] = scale * ty + law.stiffness * sy
        forces[a, 2] = scale * tz + law.stiffness * sz


@inner
def _move(state: State, law: Law, fields: HullFields) -> float:
    """Take one semi-implicit Euler step; return the square of its largest motion."""
    points, velocities, forces = state.points, state.velocities, state.forces
    before, after, pulls, crossings = state.before, state.after, state.pulls, state.crossings
    excluder, way, due = state.excluder, state.way, state.due
    rest_due, view_due = state.rest_due, state.view_due
    crossed, views = state.crossed, len(fields.starts)
    keep = 1.0 / (1.0 + law.step * law.damping / law.mass)
    gain = law.step / law.mass * keep
    if law.reading == OVERDAMPED:
        keep, gain = 0.0, 1.0 / law.damping
    largest = 0.0
    for a in range(len(points)):
        vx = velocities[a, 0] * keep + forces[a, 0] * gain
        vy = velocities[a, 1] * keep + forces[a, 1] * gain
        vz = velocities[a, 2] * keep + forces[a, 2] * gain
        dx, dy, dz = law.step * vx, law.step * vy, law.step * vz
        square = dx * dx + dy * dy + dz * dz
        largest = max(largest, square)
        x, y, z = points[a, 0] + dx, points[a, 1] + dy, points[a, 2] + dz
        way[a] += np.sqrt(square)
        if way[a] >= due[a]:
            # Written out here: handing all these arrays to a function costs more than the look.
            was, now = excluder[a], -1
            focus = was if was >= 0 else crossed[a]
            if was >= 0 or rest_due[a] > way[a]:
                distance = view_distance(fields, focus, x, y, z)
                due[a] = view_due[a, focus] = way[a] + SLACK * abs(distance)
                if distance > 0.0:
                    now = focus
                else:
                    due[a] = min(due[a], rest_due[a])
            if now < 0 and rest_due[a] <= way[a]:
                due[a] = rest_due[a] = np.inf
                for view in range(views + 1):
                    if view_due[a, view] <= way[a]:
                        distance = view_distance(fields, view, x, y, z)
                        view_due[a, view] = way[a] + SLACK * abs(distance)
                        if distance > 0.0:
                            now = view
                            due[a], rest_due[a] = view_due[a, view], 0.0
                            break
                    due[a] = min(due[a], view_due[a, view])
                    if view != focus:
                        rest_due[a] = min(rest_due[a], view_due[a, view])
            excluder[a] = now
            if (now < 0) != (was < 0):
                for k in range(3):
                    before[a, k] = points[a, k]
                after[a, 0], after[a, 1], after[a, 2] = x, y, z
                pulls[a] *= -law.decay
                crossings[a] += 1
                crossed[a] = max(was, now)
                if law.reading == VELOCITY_RESET:
                    vx = vy = vz = 0.0
        velocities[a, 0], velocities[a, 1], velocities[a, 2] = vx, vy, vz
        points[a, 0], points[a, 1], points[a, 2] = x, y, z
    return largest


@compiled
def settle(state: State, fields: HullFields) -> None:
    """Put each node where the hull's border cuts its last crossing (regula falsi)."""
    before, after, points = state.before, state.after, state.points
    for a in range(len(points)):
        view = state.crossed[a]
        low = view_distance(fields, view, before[a, 0], before[a, 1], before[a, 2])
        high = view_distance(fields, view, after[a, 0], after[a, 1], after[a, 2])
        s, t = 0.0, 1.0
        for _ in range(4):
            m = s + (t - s) * low / (low - high) if low != high else 0.5
            for k in range(3):
                points[a, k] = before[a, k] + m * (after[a, k] - before[a, k])
            critical, value = critical_view(fields, points[a, 0], points[a, 1], points[a, 2])
            if abs(value) < SETTLED_M or low == high:
                break
            if critical != view:
                # Another silhouette's border is crossed first: start again with that one.
                view, s, t = critical, 0.0, 1.0
                low = view_distance(fields, view, before[a, 0], before[a, 1], before[a, 2])
                high = view_distance(fields, view, after[a, 0], after[a, 1], after[a, 2])
            elif (value < 0.0) == (low < 0.0):
                s, low = m, value
            else:
                t, high = m, value


@compiled
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
    if law.reading == OVERDAMPED:
        kinetic = 0.0
    # Every link was met from both its ends.
    return 0.5 * law.mass * kinetic + 0.25 * law.stiffness * stretch
