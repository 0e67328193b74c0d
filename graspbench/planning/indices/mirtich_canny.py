"""Mirtich and Canny's index for discretised surfaces (thesis appendix A).

Three contacts are best when their normals lie in one plane, 120 degrees apart, and their outer triangle is
the largest: the triangle of the three lines through the contacts, perpendicular to the normals (Mirtich and
Canny, "Easily computable optimum grasps in 2-D and 3-D", 1994). On nodes no such plane exists exactly, so
the errors CEI and EEGI may reach a threshold. All combinations of the contacts' contours are looked at, and
the largest outer triangle within the thresholds is the next grasp; while there is none, the smallest errors
are. The largest triangle is often found where an error has just reached its threshold; with ``error_weight``
(not in the thesis, off by default) errors below the thresholds cost a share of the triangle.

How many fingers:

* n_f = 3: as above.
* n_f = 2: there is no outer triangle. The index is antipodality, the mean angle between the normals and the
  connecting line, with phi_cei as threshold; the longest line within it is the best grasp.
* n_f = 1 and n_f >= 4: not defined. Four lines bound no single outer polygon, and normals spaced 360 / n_f
  degrees apart are not what Mirtich and Canny prove to be best. The constructor raises ConfigurationError.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.errors import ConfigurationError
from graspbench.planning.index import INDICES, Moves
from graspbench.planning.parameters import PHI_CEI_DEG, PHI_EEGI_DEG, PhiCeiDeg, PhiEegiDeg
from graspbench.reconstruction.surface import Surface

if TYPE_CHECKING:
    from graspbench.grasp.quality import QualityParameters


@dataclass(frozen=True)
class MirtichCannyParameters:
    """Thresholds of the Mirtich-Canny index (thesis A.2)."""

    phi_cei_deg: PhiCeiDeg = PHI_CEI_DEG
    phi_eegi_deg: PhiEegiDeg = PHI_EEGI_DEG
    error_weight: Annotated[
        float,
        Field(ge=0, lt=1, description="Share of the outer triangle that errors at the thresholds are worth"),
    ] = 0.0


def mirtich_canny_scores(
    points: FloatArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Evaluate CEI, EEGI and the outer triangle of grasps with three contacts (thesis A.2).

    Args:
        points: Contacts, shape (3, 3) or (n, 3, 3), m.
        normals: Unit normals, all outward or all inward, same shape.

    Returns:
        CEI in degrees, EEGI in degrees, and the outer triangle's area in m^2, each of shape () or (n,). The
        area is 0 when the projected normals do not surround a point, so that the three lines bound no
        triangle around the grasp.
    """
    points, normals = np.asarray(points, dtype=np.float64), np.asarray(normals, dtype=np.float64)
    stacked = np.ascontiguousarray(points.reshape(-1, 3, 3))
    scores = np.empty((len(stacked), 3))
    _score_all(stacked, np.ascontiguousarray(normals.reshape(-1, 3, 3)), scores)
    shape = points.shape[:-2]
    return scores[:, 0].reshape(shape), scores[:, 1].reshape(shape), scores[:, 2].reshape(shape)


@INDICES.register("mirtich_canny")
class MirtichCanny:
    """Index that looks for the largest outer triangle on the contacts' contours.

    Args:
        parameters: Its thresholds.
        n_f: Number of fingers: three, or two for the antipodal variant.
        quality: Not used.

    Raises:
        ConfigurationError: Another number of fingers.
    """

    parameters: ClassVar[type[MirtichCannyParameters]] = MirtichCannyParameters

    def __init__(
        self, parameters: MirtichCannyParameters, n_f: int, quality: "QualityParameters | None" = None
    ) -> None:
        if n_f not in (2, 3):
            raise ConfigurationError(
                f"the Mirtich-Canny index is defined for 3 fingers (2: antipodal variant), not for {n_f}",
                remedy="set hand.fingers to 3, or choose another index",
                n_f=n_f,
            )
        self._parameters = parameters
        self._thresholds = np.array([parameters.phi_cei_deg, parameters.phi_eegi_deg])

    def propose(self, surface: Surface, vertices: IntArray, moves: Moves) -> IntArray | None:
        """Return the best combination of the contours, or None when it is the current one."""
        proposed = np.array(vertices, dtype=np.int64)
        changed = _search(
            surface.points,
            surface.normals,
            moves.nodes,
            self._thresholds,
            self._parameters.error_weight,
            proposed,
        )
        return proposed if changed else None

    def score(self, surface: Surface, vertices: IntArray) -> float:
        """Return the outer triangle's area (two contacts: the distance), or minus the relative errors."""
        scores = np.empty(3)
        score_contacts(surface.points[vertices], surface.normals[vertices], scores)
        value: float = _merit(scores, self._thresholds, self._parameters.error_weight)
        return value


@compiled
def _score_all(points: FloatArray, normals: FloatArray, scores: FloatArray) -> None:
    for g in range(points.shape[0]):
        score_contacts(points[g], normals[g], scores[g])


@compiled
def score_contacts(points: FloatArray, normals: FloatArray, scores: FloatArray) -> None:
    """Write CEI and EEGI in deg and the outer triangle's area; two contacts: error, 0, distance."""
    if points.shape[0] == 2:
        _score_pair(points, normals, scores)
        return
    plane, flat = np.empty(3), np.empty((3, 3))
    size = 0.0
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        plane[a] = (points[1, b] - points[0, b]) * (points[2, c] - points[0, c]) - (
            points[1, c] - points[0, c]
        ) * (points[2, b] - points[0, b])
        size += plane[a] ** 2
    scores[0], scores[1], scores[2] = 90.0, 120.0, 0.0
    if size <= 0.0:
        return
    tilt = 0.0
    for j in range(3):
        out = 0.0
        for a in range(3):
            out += normals[j, a] * plane[a] / np.sqrt(size)
        tilt += abs(np.arccos(min(1.0, max(-1.0, out))) - 0.5 * np.pi)
        length = 0.0
        for a in range(3):
            flat[j, a] = normals[j, a] - out * plane[a] / np.sqrt(size)
            length += flat[j, a] ** 2
        if length <= 1e-18:
            return
        for a in range(3):
            flat[j, a] /= np.sqrt(length)
    scores[0] = np.rad2deg(tilt / 3.0)
    uneven, positive, product, sum_sine = 0.0, 0, 1.0, 0.0
    for j in range(3):
        # The pair (k, m) is opposite to contact j.
        k, m = (j + 1) % 3, (j + 2) % 3
        cosine, sine, height = 0.0, 0.0, 0.0
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            cosine += flat[k, a] * flat[m, a]
            sine += (flat[k, b] * flat[m, c] - flat[k, c] * flat[m, b]) * plane[a] / np.sqrt(size)
            height += flat[j, a] * (points[j, a] - points[0, a])
        uneven += abs(np.arctan2(abs(sine), cosine) - 2.0 * np.pi / 3.0)
        positive += 1 if sine > 0.0 else 0
        product *= sine
        # Weighted by these sines the three normals sum to zero, so the sum does not depend on the origin.
        sum_sine += sine * height
    scores[1] = np.rad2deg(uneven / 3.0)
    if (positive == 3 or positive == 0) and product != 0.0:
        scores[2] = sum_sine * sum_sine / (2.0 * abs(product))


@compiled
def _score_pair(points: FloatArray, normals: FloatArray, scores: FloatArray) -> None:
    distance = 0.0
    for a in range(3):
        distance += (points[1, a] - points[0, a]) ** 2
    distance = np.sqrt(distance)
    scores[0], scores[1], scores[2] = 90.0, 0.0, distance
    if distance <= 0.0:
        return
    total = 0.0
    for j in range(2):
        along = 0.0
        for a in range(3):
            along += normals[j, a] * (points[j, a] - points[1 - j, a]) / distance
        total += np.arccos(min(1.0, max(-1.0, along)))
    scores[0] = np.rad2deg(0.5 * total)


@compiled
def _merit(scores: FloatArray, thresholds: FloatArray, weight: float) -> float:
    """Return the size of a grasp within the thresholds, or minus its errors relative to them."""
    first, second = scores[0] / thresholds[0], scores[1] / thresholds[1]
    if first > 1.0 or second > 1.0 or scores[2] <= 0.0:
        return float(-first - second)
    # Errors below the thresholds count a little, else discretisation noise decides among equals.
    return float(scores[2] * (1.0 - 0.5 * weight * (first + second)))


@compiled
def _search(
    points: FloatArray,
    normals: FloatArray,
    moves: IntArray,
    thresholds: FloatArray,
    weight: float,
    vertices: IntArray,
) -> bool:
    """Write the best combination of moves; return whether it is another one."""
    n_f, width = moves.shape
    contacts, directions, scores = np.empty((n_f, 3)), np.empty((n_f, 3)), np.empty(3)
    chosen, best = np.empty(n_f, dtype=np.int64), -1e30
    found = 0
    for combination in range(width**n_f):
        rest, allowed = combination, True
        for i in range(n_f):
            node = moves[i, rest % width]
            rest //= width
            if node < 0:
                allowed = False
                break
            chosen[i] = node
            for a in range(3):
                contacts[i, a] = points[node, a]
                directions[i, a] = normals[node, a]
        if not allowed:
            continue
        score_contacts(contacts, directions, scores)
        merit = _merit(scores, thresholds, weight)
        # Combination 0 is to stay; rounding is no reason to leave.
        if merit > best + 1e-12 * abs(best):
            best, found = merit, combination
    changed = found != 0
    for i in range(n_f):
        vertices[i] = moves[i, found % width]
        found //= width
    return changed
