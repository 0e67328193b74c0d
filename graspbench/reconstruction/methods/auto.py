"""The thesis' surface where it can have the object's topology, the hull's own net where it cannot."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from graspbench.arrays import FloatArray
from graspbench.reconstruction.genus import method_for
from graspbench.reconstruction.methods import METHODS
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.surface import Surface

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette


@METHODS.register("auto")
def reconstruct_auto(
    silhouettes: "Sequence[Silhouette]", parameters: SurfaceParameters, centre: FloatArray | None = None
) -> Iterator[Surface]:
    """Reconstruct by method ``hull_net`` if any silhouette has a hole, else by ``elastic``.

    Arguments, surfaces and errors are those of the method taken.
    """
    yield from METHODS[method_for(silhouettes)](silhouettes, parameters, centre)
