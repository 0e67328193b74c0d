"""The evidence that a file of grasps was written as it is read: tips at the object, joints within limits."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from graspbench.arrays import FloatArray
from graspbench.evaluation.formats.format import FormatContext
from graspbench.evaluation.grasp_record import GraspRecord, HandPose

_SAMPLES = 20_000
_FINE_M = 0.003
_OUTSIDE_RAD = 0.02
MAX_OUTSIDE = 0.02
"""Share of the joints that may be outside of their limits in grasps that were meant so."""

SHARE = 0.5
_FAR_SHARE = 0.1


@dataclass(frozen=True)
class Evidence:
    """How well grasps fit the object and the hand.

    Attributes:
        off_m: How far fingertips are off the object's surface, the median over grasps.
        outside: Share of the joints that are outside of their limits.
    """

    off_m: float
    outside: float

    @property
    def speaks_for(self) -> bool:
        """Whether grasps are as grasps are, so that nothing seems to be wrong."""
        return self.off_m <= _FINE_M and self.outside <= MAX_OUTSIDE

    def beats(self, other: "Evidence") -> bool:
        """Tell whether this reading is so much better that the other was not meant."""
        near = self.off_m <= max(_FINE_M, _FAR_SHARE * other.off_m)
        nearer = near and self.off_m < SHARE * other.off_m and self.outside <= other.outside + 1e-9
        rightful = self.outside <= MAX_OUTSIDE < other.outside and self.off_m <= 1.1 * other.off_m
        return nearer or rightful


class Gauge:
    """Measures how far fingertips are off an object."""

    def __init__(self, context: FormatContext) -> None:
        self._hand, self._scale = context.hand, context.object_scale
        points, _ = trimesh.sample.sample_surface(context.object_model.mesh, _SAMPLES, seed=0)
        self._tree = cKDTree(np.asarray(points))

    def evidence(self, records: Sequence[GraspRecord]) -> Evidence:
        """Return how far tips are off, and which share of the joints is outside of limits."""
        joints = np.stack([hand_of(record).joints for record in records])
        beyond = np.maximum(self._hand.lower - joints, joints - self._hand.upper) > _OUTSIDE_RAD
        tips = np.stack([self._hand.tip_positions(row) for row in joints])
        return Evidence(self._off_m(records, tips), float(beyond.mean()))

    def mirrored(self, records: Sequence[GraspRecord]) -> Iterator[Evidence]:
        """Yield the evidence for hands mirrored in a plane through the palm's axis."""
        hand = self._hand
        spread = hand.upper - hand.lower
        # Joints that bend to either side alike turn the other way in some mirrored hands.
        sideways = np.where(np.abs(hand.upper + hand.lower) < 0.1 * spread, -1.0, 1.0)
        joints = np.stack([hand_of(record).joints for record in records])
        outside = self.evidence(records).outside
        for signs, axis in product((np.ones(hand.n_joints), sideways), (0, 1)):
            tips = np.stack([hand.tip_positions(row) for row in signs * joints])
            tips[..., axis] *= -1.0
            yield Evidence(self._off_m(records, tips), outside)

    def _off_m(self, records: Sequence[GraspRecord], tips: FloatArray) -> float:
        """Return how far tips are off, palm frame, shape (n, n_f, 3): the median over grasps.

        Of each grasp it is the upper quartile over fingers: one of several may be meant to stay away.
        """
        palms = np.stack([hand_of(record).transform_palm_to_object for record in records])
        # The gauge is of one size; grasps of other sizes are brought to it.
        sizes = np.array([self._scale / record.object_scale for record in records])[:, None]
        centres = np.einsum("nij,nfj->nfi", palms[:, :3, :3], tips) + palms[:, None, :3, 3]
        distances, _ = self._tree.query(centres * sizes[..., None])
        off = np.abs(distances / sizes - self._hand.tip_radius_m)
        return float(np.median(np.quantile(off, 0.75, axis=1)))


def hand_of(record: GraspRecord) -> HandPose:
    """Return the hand of a grasp that has one."""
    assert record.grasp is not None, "only grasps with a hand are looked at"
    return record.grasp
