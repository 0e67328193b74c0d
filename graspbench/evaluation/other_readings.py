"""Ways to read a file of grasps that its writer may have meant."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.reading import AS_STATED, Reading

READINGS = {
    "xyzw": Reading(quaternion="xyzw"),
    "degrees": Reading(radians_per_unit=float(np.pi / 180.0)),
    "millimetres": Reading(metres_per_unit=1e-3),
}
"""Ways to read a file that its writer may have meant, by name."""


def combined_reading(names: Sequence[str]) -> Reading:
    """Return a way to read a file from the names of what differs.

    Raises:
        GraspFileError: There is no such name.
    """
    reading = AS_STATED
    for name in names:
        if name not in READINGS:
            raise GraspFileError(
                f"a file cannot be read as '{name}'", remedy=f"choose from {', '.join(READINGS)}"
            )
        changes = {
            key: value for key, value in vars(READINGS[name]).items() if value != getattr(AS_STATED, key)
        }
        reading = replace(reading, **changes)
    return reading
