"""Compiled multi-start around ``placement``: where to start, what counts as feasible, what is best."""

import math

import numpy as np
from numba import njit

from graspbench.arrays import FloatArray, IntArray
from graspbench.hand.chains import Chains
from graspbench.hand.kinematics import forward
from graspbench.hand.placement import Task, Work, improve, make_work, measure
from graspbench.hand.shapes import Shapes

TIP_TOLERANCE_M = 1e-5
GOOD_ENOUGH = 0.5
# What a posture's quantity is compared with to say how comfortable it is: joint margin, singular value,
# clearances to ground, hand and object.
COMFORT = (0.15, 0.02, 0.01, 0.005, 0.005)
BELOW_PENALTY_M = 0.15


@njit(cache=True, nogil=True)
def failures(measured: FloatArray, task: Task) -> int:
    """Return which requirements a measured posture fails, as bits in the order of ``measured``."""
    bits = 0
    if measured[0] > TIP_TOLERANCE_M:
        bits |= 1
    if measured[1] < task.margins[3]:
        bits |= 2
    if measured[2] < task.margins[4]:
        bits |= 4
    for i in range(3):
        if measured[3 + i] < task.margins[i]:
            bits |= 8 << i
    return bits


@njit(cache=True, nogil=True)
def comfort(measured: FloatArray) -> float:
    """Return how far a posture stays from what it must not reach, 1 being comfortable in every respect."""
    least = 1.0
    for i in range(5):
        least = min(least, measured[1 + i] / COMFORT[i])
    return least


@njit(cache=True, nogil=True)
def approach_directions(task: Task, out: FloatArray) -> int:
    """List approach directions worth trying, best guesses first.

    Down; against the mean outward normal; both normals of the contacts' plane; from the sides, tilted
    more and more. With a ground, directions that come from below are left out.

    Args:
        task: The contacts.
        out: Output, unit vectors, shape (>= 32, 3).

    Returns:
        How many there are.
    """
    n = 0
    m = task.points.shape[0]
    centre, mean, plane = np.zeros(3), np.zeros(3), np.zeros(3)
    for i in range(m):
        centre += task.points[i] / m
        mean += task.normals[i] / m
    for i in range(m):
        a, b = task.points[i] - centre, task.points[(i + 1) % m] - centre
        plane[0] += a[1] * b[2] - a[2] * b[1]
        plane[1] += a[2] * b[0] - a[0] * b[2]
        plane[2] += a[0] * b[1] - a[1] * b[0]
    length = math.sqrt(np.sum(plane * plane))
    grounded = task.ground_height > -np.inf
    if length > 1e-6:
        plane /= length
        if plane[2] > 0.0:
            plane = -plane
        n = _append(out, n, plane[0], plane[1], plane[2])
        if not grounded or plane[2] > -0.35:
            n = _append(out, n, -plane[0], -plane[1], -plane[2])
    n = _append(out, n, 0.0, 0.0, -1.0)
    length = math.sqrt(np.sum(mean * mean))
    if length > 0.15 and (not grounded or mean[2] / length > -0.35):
        mean /= -length
        n = _append(out, n, mean[0], mean[1], mean[2])
    for tilt in (30.0, 60.0, 85.0):
        s, c = math.sin(math.radians(tilt)), math.cos(math.radians(tilt))
        for turn in range(6):
            angle = math.radians(60.0 * turn + tilt)
            n = _append(out, n, s * math.cos(angle), s * math.sin(angle), -c)
    if not grounded:
        n = _append(out, n, 0.0, 0.0, 1.0)
    return n


@njit(cache=True, nogil=True)
def _append(out: FloatArray, n: int, x: float, y: float, z: float) -> int:
    for i in range(n):
        if out[i, 0] * x + out[i, 1] * y + out[i, 2] * z > 0.985:
            return n
    out[n, 0], out[n, 1], out[n, 2] = x, y, z
    return n + 1


@njit(cache=True, nogil=True)
def align(
    approach: FloatArray, targets: FloatArray, contact_of: IntArray, tips: FloatArray,
    rotation: FloatArray, translation: FloatArray,
) -> float:
    """Best palm pose with its z axis along ``approach`` for given tips: a turn and a shift in closed form.

    Args:
        approach: Unit vector, world, shape (3,).
        targets: Wanted tip centres, world, shape (m, 3).
        contact_of: Contact of each finger, -1 for none, shape (f,).
        tips: Tip centres, palm frame, shape (f, 3).
        rotation: Output, shape (3, 3).
        translation: Output, shape (3,).

    Returns:
        The mean squared distance left.
    """
    axis = 0
    for i in range(1, 3):
        if abs(approach[i]) < abs(approach[axis]):
            axis = i
    x = np.zeros(3)
    x[axis] = 1.0
    x -= approach * approach[axis]
    x /= math.sqrt(np.sum(x * x))
    y = np.empty(3)
    y[0] = approach[1] * x[2] - approach[2] * x[1]
    y[1] = approach[2] * x[0] - approach[0] * x[2]
    y[2] = approach[0] * x[1] - approach[1] * x[0]
    m = 0
    centre, middle = np.zeros(3), np.zeros(3)
    for f in range(contact_of.size):
        if contact_of[f] >= 0:
            centre += targets[contact_of[f]]
            middle += tips[f]
            m += 1
    centre /= m
    middle /= m
    cosine = sine = square = 0.0
    for f in range(contact_of.size):
        if contact_of[f] < 0:
            continue
        gap = targets[contact_of[f]] - centre
        u, v, w = np.sum(gap * x), np.sum(gap * y), np.sum(gap * approach)
        a, b, c = tips[f, 0] - middle[0], tips[f, 1] - middle[1], tips[f, 2] - middle[2]
        cosine += a * u + b * v
        sine += a * v - b * u
        square += u * u + v * v + a * a + b * b + (w - c) ** 2
    length = math.sqrt(cosine * cosine + sine * sine)
    c, s = (cosine / length, sine / length) if length > 1e-12 else (1.0, 0.0)
    for i in range(3):
        rotation[i, 0] = c * x[i] + s * y[i]
        rotation[i, 1] = c * y[i] - s * x[i]
        rotation[i, 2] = approach[i]
    for i in range(3):
        translation[i] = centre[i]
        for j in range(3):
            translation[i] -= rotation[i, j] * middle[j]
    return max(square - 2.0 * length, 0.0) / m


@njit(cache=True, nogil=True)
def _rank_starts(
    chains: Chains, task: Task, assignments: IntArray, tips: FloatArray, directions: FloatArray,
    contacts: IntArray, rotations: FloatArray, translations: FloatArray,
) -> int:
    """Fill the starts, best first: for every direction its best assignments."""
    n = chains.counts.size
    kept = contacts.shape[0]
    costs = np.full(kept, np.inf)
    contact_of = np.empty(n, dtype=np.int64)
    rotation, translation = np.empty((3, 3)), np.empty(3)
    count = 0
    for d in range(directions.shape[0]):
        best_cost, second_cost = np.inf, np.inf
        best, second = -1, -1
        for a in range(assignments.shape[0]):
            _invert(assignments[a], contact_of)
            cost = align(directions[d], task.targets, contact_of, tips, rotation, translation)
            if cost < best_cost:
                second_cost, second, best_cost, best = best_cost, best, cost, a
            elif cost < second_cost:
                second_cost, second = cost, a
        for choice in range(2):
            a = best if choice == 0 else second
            if a < 0:
                continue
            _invert(assignments[a], contact_of)
            cost = align(directions[d], task.targets, contact_of, tips, rotation, translation)
            if task.ground_height > -np.inf:
                # A palm near or below the ground is a last resort.
                low = task.ground_height + 0.02 - translation[2]
                if low > 0.0:
                    cost += BELOW_PENALTY_M**2
            position = min(count, kept)
            while position > 0 and costs[position - 1] > cost:
                position -= 1
            if position >= kept:
                continue
            for i in range(min(count, kept - 1), position, -1):
                costs[i] = costs[i - 1]
                contacts[i], rotations[i], translations[i] = contacts[i - 1], rotations[i - 1], translations[i - 1]
            costs[position] = cost
            contacts[position], rotations[position], translations[position] = contact_of, rotation, translation
            count = min(count + 1, kept)
    return count


@njit(cache=True, nogil=True)
def _invert(fingers: IntArray, contact_of: IntArray) -> None:
    contact_of[:] = -1
    for i in range(fingers.size):
        contact_of[fingers[i]] = i


@njit(cache=True, nogil=True)
def attempt(
    chains: Chains, shapes: Shapes, task: Task, contact_of: IntArray, rotation: FloatArray,
    translation: FloatArray, joints: FloatArray, work: Work, warm: bool, measured: FloatArray,
) -> int:
    """Improve one start in place and measure it.

    Returns:
        The requirements it fails, as bits; 0 when it is feasible.
    """
    if not warm:
        cost = improve(
            chains, shapes, task, contact_of, rotation, translation, joints, work, False, 10
        )
        if cost > 400.0:
            # Tips stay more than about 2 cm away: no use in looking at collisions.
            measured[:] = 0.0
            measured[0] = math.sqrt(cost) * 1e-3
            return 1
    improve(chains, shapes, task, contact_of, rotation, translation, joints, work, True, 8 if warm else 20)
    measure(chains, shapes, task, contact_of, rotation, translation, joints, work, measured)
    return failures(measured, task)


@njit(cache=True, nogil=True)
def search(
    chains: Chains, shapes: Shapes, task: Task, assignments: IntArray, rest: FloatArray, starts: int,
    rotation: FloatArray, translation: FloatArray, joints: FloatArray, contact_of: IntArray,
    measured: FloatArray,
) -> int:
    """Find a feasible posture from several starts; the most comfortable, or the first comfortable enough.

    Args:
        chains: The fingers.
        shapes: The collision shapes.
        task: What to reach and to avoid.
        assignments: Finger of each contact, one row a choice, shape (a, m).
        rest: Joints of fingers without contact, shape (f, k).
        starts: Most starts to try.
        rotation: Output, palm orientation, shape (3, 3).
        translation: Output, palm origin, shape (3,).
        joints: Output, joints by finger, shape (f, k).
        contact_of: Output, contact of each finger or -1, shape (f,).
        measured: Output, see ``measure``, shape (6,).

    Returns:
        The requirements failed, as bits (0: feasible). Outputs are of the best posture in any case.
    """
    n, k = chains.lower.shape
    work = make_work(chains, shapes, task.obstacle.shape[0])
    directions = np.empty((40, 3))
    directions = directions[: approach_directions(task, directions)]
    for f in range(n):
        forward(chains, f, chains.preferred[f], work.rotations[f], work.origins[f], work.tips[f])
    contacts = np.empty((starts, n), dtype=np.int64)
    rotations, translations = np.empty((starts, 3, 3)), np.empty((starts, 3))
    count = _rank_starts(chains, task, assignments, work.tips.copy(), directions, contacts, rotations, translations)
    best_bits, best_score = 1 << 30, -np.inf
    trial_rotation, trial_translation, trial_joints = np.empty((3, 3)), np.empty(3), np.empty((n, k))
    trial = np.empty(6)
    for i in range(count):
        trial_rotation[:], trial_translation[:] = rotations[i], translations[i]
        for f in range(n):
            trial_joints[f] = chains.preferred[f] if contacts[i, f] >= 0 else rest[f]
        bits = attempt(
            chains, shapes, task, contacts[i], trial_rotation, trial_translation, trial_joints, work, False, trial
        )
        score = comfort(trial) if bits & 1 == 0 else -trial[0] * 1e3
        if (bits == 0) > (best_bits == 0) or ((bits == 0) == (best_bits == 0) and score > best_score):
            best_bits, best_score = bits, score
            rotation[:], translation[:], joints[:] = trial_rotation, trial_translation, trial_joints
            contact_of[:] = contacts[i]
            measured[:] = trial
        if best_bits == 0 and best_score >= GOOD_ENOUGH:
            break
    return best_bits
