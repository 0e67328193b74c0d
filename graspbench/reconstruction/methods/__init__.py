"""Reconstructions that can be chosen by name: each module here registers one."""

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeAlias

from graspbench.arrays import FloatArray
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.surface import Surface
from graspbench.registry import Registry

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette

Reconstruction: TypeAlias = Callable[
    ["Sequence[Silhouette]", SurfaceParameters, FloatArray | None], Iterator[Surface]
]
"""Silhouettes, parameters and a guess of the centre (or None) to an iterator of surfaces.

All surfaces share one network; the last has ``at_rest=True``. What a method needs beyond the common
parameters it reads from ``parameters.options``.
"""

METHODS: Registry[Reconstruction] = Registry("reconstruction", __name__)
