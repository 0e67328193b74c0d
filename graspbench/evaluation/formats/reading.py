"""How the numbers of a file are taken: as its format says, or as a wrong writer may have meant them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import shown
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.transforms import UNIT_TOLERANCE, transform_of

_MAX_M = 1e6
_MAX_NUMBERS = 100_000
_MAX_DEPTH = 3
_MAX_DIGITS = 40
_MIN_SCALE = 1e-6


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


def array(value: object, what: str) -> FloatArray:
    """Return numbers of a file as an array of any shape.

    Lists that hold each other many times over, as YAML and pickles can have them, are not followed.

    Raises:
        GraspFileError: They are none, or too many.
    """
    if _is_table(value):
        try:
            return np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            pass
    raise GraspFileError(f"{what} is {shown(value)}", remedy="give numbers")


def _is_table(value: object) -> bool:
    """Tell an array of numbers, or not too many numbers in lists."""
    waiting: list[tuple[object, int]] = [(value, 0)]
    count = 0
    while waiting:
        item, depth = waiting.pop()
        count += 1
        if isinstance(item, list | tuple):
            if depth == _MAX_DEPTH or count + len(waiting) + len(item) > _MAX_NUMBERS:
                return False
            waiting += [(each, depth + 1) for each in item]
        elif isinstance(item, np.ndarray):
            count += item.size if depth else 0
            if item.dtype.kind not in "biuf" or count > _MAX_NUMBERS:
                return False
        elif not isinstance(item, int | float | np.number) and not _is_number(item):
            return False
    return True


def _is_number(item: object) -> bool:
    """Tell a number that was written as text, as YAML takes 1e-3 for text."""
    return isinstance(item, str) and len(item) <= _MAX_DIGITS


def text(value: object, what: str, default: str) -> str:
    """Return a text of a file; the default where it is None or empty.

    Raises:
        GraspFileError: It is none.
    """
    if value is None or (isinstance(value, str | np.str_) and not value):
        return default
    if not isinstance(value, str):
        raise GraspFileError(f"{what} is {shown(value)}", remedy="give text")
    return str(value)


def scale_of(value: object, what: str, default: float | None = None) -> float:
    """Return the scale of a mesh; the default where it is None.

    Raises:
        GraspFileError: It is no factor that a mesh can have.
    """
    found = number(value, what, default)
    if not _MIN_SCALE <= found <= 1.0 / _MIN_SCALE:
        raise GraspFileError(f"{what} is {found:g}", remedy=f"give a factor of at least {_MIN_SCALE:g}")
    return found


def listed(value: object, what: str) -> Sequence[object]:
    """Return a list of a file.

    Raises:
        GraspFileError: It is none.
    """
    if not isinstance(value, list | tuple):
        raise GraspFileError(f"{what} is {shown(value)}", remedy="give a list")
    return value


def vector(value: object, size: int | None, what: str) -> FloatArray:
    """Return a row of finite numbers of a file.

    Raises:
        GraspFileError: It is none, or of another length.
    """
    numbers = array(value, what)
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
    numbers = array(value, what)
    if numbers.ndim:
        raise GraspFileError(f"{what} is {shown(value)}", remedy="give a number")
    found = float(numbers)
    if not np.isfinite(found):
        raise GraspFileError(f"{what} is {found}", remedy="give a finite number")
    return found
