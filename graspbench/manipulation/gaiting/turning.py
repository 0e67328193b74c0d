"""The axis an object turns about, and angles around it."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Turning:
    """A turn of the object about an axis through its origin, in the palm frame.

    Attributes:
        axis: Unit vector of positive turns, shape (3,).
        position: The object's origin, shape (3,), m.
        rotation: Orientation before any turn, shape (3, 3).
    """

    axis: FloatArray
    position: FloatArray
    rotation: FloatArray

    def at(self, angle_deg: float) -> FloatArray:
        """Return the orientation after a turn, shape (3, 3)."""
        turned: FloatArray = Rotation.from_rotvec(np.deg2rad(angle_deg) * self.axis).as_matrix()
        return turned @ self.rotation

    def pose(self, angle_deg: float) -> FloatArray:
        """Return transform_object_to_palm after a turn, shape (4, 4)."""
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = self.at(angle_deg), self.position
        return pose


def grasp_normal(points: FloatArray) -> FloatArray:
    """Return the unit normal of the plane nearest to contacts, shape (3,), towards the palm's back.

    Args:
        points: Contacts in the palm frame, whose z axis points from the palm to the object, shape (n, 3).
            Of two contacts: the direction across their line that is nearest to the palm's z axis.
    """
    arms = points - points.mean(axis=0)
    if len(points) == 2:
        along = arms[0] / np.linalg.norm(arms[0])
        normal = np.array([0.0, 0.0, 1.0]) - along[2] * along
    else:
        normal = np.linalg.svd(arms)[2][2]
    normal = normal / np.linalg.norm(normal)
    # turns are counted as one sees them who looks from the palm onto the object
    sign = -1.0 if normal[2] > 0.0 else 1.0
    out: FloatArray = sign * normal
    return out
