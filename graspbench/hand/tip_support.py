"""Compiled support point of a fingertip's real shape: where it touches a plane that comes from a direction.

A tip is the convex hull of balls and discs, swept by balls: ``Chains.elements``. Its support function is the
largest of theirs, h(d) = max_i h_i(d); the soft maximum h(d) = tau log sum_i exp(h_i(d) / tau) belongs to a
smooth convex body around it, which stands out by tau log(n) at most where n of them are equally far, and not
at all at a corner. A body with support function h has its point with the outward normal d at
grad h - (grad h . d) d + h d (Schneider 2014, section 1.7), and that point has a derivative everywhere.
"""

import math

import numpy as np

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.hand.chains import DISC, ROUND, Chains
from graspbench.hand.kinematics import forward

FINAL_SHARPNESS_M = 1e-5
"""The soft maximum's tau of a posture that was found: an edge stands out by 0.007 mm, a face by 0.014 mm."""

_NEGLIGIBLE = 30.0
_BLUNT = 1e-3  # a disc's rim is smooth across its axis, too
C, H = 0, 3


@inner
def has_surface(chains: Chains, f: int) -> bool:
    """Tell whether a finger touches with its last link's real shape."""
    has: bool = chains.spans[f, 1] > chains.spans[f, 0]
    return has


@compiled
def support(
    chains: Chains, f: int, frame: FloatArray, x: float, y: float, z: float, sharpness: float, out: FloatArray
) -> None:
    """Compute where a tip's shape has an outward normal, and how this point moves as the normal turns.

    Args:
        chains: The fingers.
        f: Which finger, one that has elements.
        frame: Frame of its last joint, shape (3, 4).
        x: Outward unit normal, in the frame that ``frame`` is given in.
        y: Outward unit normal.
        z: Outward unit normal.
        sharpness: The soft maximum's tau, m.
        out: Output: the point in the last joint's frame, shape (3,); then its derivative by the normal, in
            the frame that ``frame`` is given in, rows of shape (3, 3) one after the other; shape (12,).
    """
    d = (
        frame[0, 0] * x + frame[1, 0] * y + frame[2, 0] * z,
        frame[0, 1] * x + frame[1, 1] * y + frame[2, 1] * z,
        frame[0, 2] * x + frame[1, 2] * y + frame[2, 2] * z,
    )
    first, last = chains.spans[f, 0], chains.spans[f, 1]
    highest = -math.inf
    for i in range(first, last):
        highest = max(highest, _height(chains.elements[i], d))
    total, mean, own = 0.0, np.zeros(3), np.zeros(3)
    second = np.zeros((3, 3))
    for i in range(first, last):
        element = chains.elements[i]
        height = _height(element, d)
        if height < highest - _NEGLIGIBLE * sharpness:
            continue
        weight = math.exp((height - highest) / sharpness)
        total += weight
        disc, ball = element[DISC], element[ROUND]
        along = d[0] * element[3] + d[1] * element[4] + d[2] * element[5]
        length = 1.0
        if disc > 0.0:
            length = math.sqrt(max(1.0 - along * along, 0.0) + _BLUNT * _BLUNT)
        for a in range(3):
            own[a] = element[a] + disc * (d[a] - along * element[3 + a]) / length + ball * d[a]
            mean[a] += weight * own[a]
        for a in range(3):
            across_a = d[a] - along * element[3 + a]
            for b in range(3):
                across_b = d[b] - along * element[3 + b]
                same = 1.0 if a == b else 0.0
                value = own[a] * own[b] / sharpness + ball * (same - d[a] * d[b])
                if disc > 0.0:
                    value += disc * (same - element[3 + a] * element[3 + b]) / length
                    value -= disc * across_a * across_b / length**3
                second[a, b] += weight * value
    reach = 0.0
    for a in range(3):
        mean[a] /= total
        reach += mean[a] * d[a]
    lift = highest + sharpness * math.log(total) - reach
    for a in range(3):
        out[C + a] = mean[a] + lift * d[a]
        for b in range(3):
            second[a, b] = second[a, b] / total - mean[a] * mean[b] / sharpness
    # The point slides along the plane: what is left of its motion has no part along d.
    for b in range(3):
        along = d[0] * second[0, b] + d[1] * second[1, b] + d[2] * second[2, b]
        for a in range(3):
            second[a, b] -= along * d[a]
        second[b, b] += lift
    # Into the outer frame: R S R^T.
    for a in range(3):
        for b in range(3):
            value = 0.0
            for i in range(3):
                for j in range(3):
                    value += frame[a, i] * second[i, j] * frame[b, j]
            out[H + 3 * a + b] = value


@inner
def _height(element: FloatArray, d: tuple[float, float, float]) -> float:
    height = element[0] * d[0] + element[1] * d[1] + element[2] * d[2] + element[ROUND]
    if element[DISC] > 0.0:
        along = element[3] * d[0] + element[4] * d[1] + element[5] * d[2]
        height += element[DISC] * math.sqrt(max(1.0 - along * along, 0.0) + _BLUNT * _BLUNT)
    reached: float = height
    return reached


@compiled
def touching_points(
    chains: Chains,
    fingers: IntArray,
    joints: FloatArray,
    normals: FloatArray,
    sharpness: float,
    out: FloatArray,
) -> None:
    """Compute where fingers touch, in the frames of their last joints.

    Args:
        chains: The fingers.
        fingers: Those that touch, shape (m,).
        joints: Joints by finger, shape (f, k).
        normals: Outward normals of what they touch, palm frame, shape (m, 3).
        sharpness: The soft maximum's tau, m.
        out: Output, rows of fingers that touch with their shapes are written, shape (f, 3).
    """
    frames, tip, found = np.empty((joints.shape[1], 3, 4)), np.empty(3), np.empty(12)
    for i in range(fingers.size):
        f = fingers[i]
        if not has_surface(chains, f):
            continue
        forward(chains, f, joints[f], frames, tip)
        frame = frames[chains.counts[f] - 1]
        support(chains, f, frame, -normals[i, 0], -normals[i, 1], -normals[i, 2], sharpness, found)
        for a in range(3):
            out[f, a] = found[C + a]
