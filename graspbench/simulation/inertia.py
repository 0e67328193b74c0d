"""Inertia tensors that PyBullet accepts."""

from xml.etree import ElementTree

import numpy as np

from graspbench.arrays import FloatArray

_ROOM = 1.05


def mend_inertias(robot: ElementTree.Element) -> None:
    """Make the inertia tensors of a URDF possible, in place.

    No body's largest principal moment exceeds the sum of the two others. Where a URDF says so, PyBullet
    takes all three as zero, and a finger that ends in such a link cannot be simulated in long steps.

    Args:
        robot: The URDF's root element.
    """
    for element in robot.iter("inertia"):
        tensor = _tensor(element)
        possible = possible_inertia(tensor)
        if possible is not tensor:
            for name, (i, j) in _ENTRIES.items():
                element.set(name, f"{possible[i, j]:.9g}")


def possible_inertia(tensor: FloatArray) -> FloatArray:
    """Return an inertia tensor, shape (3, 3), or one with its small principal moments raised if need be."""
    moments, axes = np.linalg.eigh(tensor)
    largest = float(moments[2])
    if (moments[0] > 0.0 and moments[0] + moments[1] >= largest) or largest <= 0.0:
        return tensor
    least = 0.5 * _ROOM * largest
    raised = np.maximum(moments, [_ROOM * largest - max(moments[1], least), least, 0.0])
    possible: FloatArray = axes @ np.diag(raised) @ axes.T
    return possible


_ENTRIES = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def _tensor(element: ElementTree.Element) -> FloatArray:
    tensor = np.zeros((3, 3))
    for name, (i, j) in _ENTRIES.items():
        tensor[i, j] = tensor[j, i] = float(element.get(name, 0.0))
    return tensor
