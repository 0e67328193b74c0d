"""How the numbers of a file are taken: as its format says, or as a wrong writer may have meant them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import shown
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.transforms import UNIT_TOLERANCE, transform_of

_MAX_M = 1e6


@dataclass(frozen=True)
class Reading:
    """How numbers are taken.

    Attributes:
        quaternion: Order of a quaternion's numbers.
        metres_per_unit: Of positions.
        radians_per_unit: Of turning joints.
        joint_order: Which of the file's joints is taken for each, shape (k,); None: each for itself.
    """

    quaternion: Literal["wxyz", "xyzw"] = "wxyz"
    metres_per_unit: float = 1.0
    radians_per_unit: float = 1.0
    joint_order: tuple[int, ...] | None = None

    def transform(self, position: object, quaternion: object, where: str) -> FloatArray:
        """Return the transform, shape (4, 4), of a position and a quaternion.

        Raises:
            GraspFileError: They are no such numbers, or the quaternion is far from a unit one.
        """
        numbers = vector(quaternion, 4, f"{where}: the quaternion")
        norm = float(np.linalg.norm(numbers))
        if abs(norm - 1.0) > UNIT_TOLERANCE:
            raise GraspFileError(
                f"{where}: the quaternion has the norm {norm:.3g} instead of 1",
                remedy="write unit quaternions with w first",
            )
        if self.quaternion == "xyzw":
            numbers = np.roll(numbers, 1)
        at = self.metres_per_unit * vector(position, 3, f"{where}: the position")
        return transform_of(at, numbers)

    def row(self, joints: FloatArray) -> FloatArray:
        """Return a row of joints in the file's stated order and in rad, shape (k,)."""
        taken = joints if self.joint_order is None else joints[list(self.joint_order)]
        return np.asarray(self.radians_per_unit * taken, dtype=np.float64)


AS_STATED = Reading()


def vector(value: object, size: int | None, what: str) -> FloatArray:
    """Return a row of finite numbers of a file.

    Raises:
        GraspFileError: It is none, or of another length.
    """
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise GraspFileError(f"{what} is {shown(value)}", remedy="give numbers") from None
    wanted = "numbers" if size is None else f"{size} numbers"
    if numbers.ndim != 1 or (size is not None and len(numbers) != size):
        raise GraspFileError(f"{what} has the shape {numbers.shape}", remedy=f"give {wanted} in a row")
    if not np.all(np.isfinite(numbers)) or np.abs(numbers).max(initial=0.0) > _MAX_M:
        raise GraspFileError(
            f"{what} holds a number that is not finite or beyond all size", remedy="correct it"
        )
    return numbers


def number(value: object, what: str, default: float | None = None) -> float:
    """Return a finite number of a file; the default where it is None.

    Raises:
        GraspFileError: It is none.
    """
    if value is None and default is not None:
        return default
    try:
        found = float(np.asarray(value, dtype=np.float64).reshape(()))
    except (TypeError, ValueError):
        raise GraspFileError(f"{what} is {shown(value)}", remedy="give a number") from None
    if not np.isfinite(found):
        raise GraspFileError(f"{what} is {found}", remedy="give a finite number")
    return found
