"""From silhouettes to surfaces by the method that the configuration names."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from graspbench.arrays import FloatArray
from graspbench.reconstruction.methods import METHODS
from graspbench.reconstruction.parameters import SurfaceParameters
from graspbench.reconstruction.surface import Surface

if TYPE_CHECKING:
    from graspbench.perception.silhouette import Silhouette


def reconstruct(
    silhouettes: "Sequence[Silhouette]", parameters: SurfaceParameters, *, centre: FloatArray | None = None
) -> Iterator[Surface]:
    """Reconstruct the surface of one object; every surface yielded can be planned on.

    Args:
        silhouettes: With ideal pinhole cameras.
        parameters: `method` names a registered reconstruction, which reads the rest.
        centre: Guess of the object's centroid, shape (3,); triangulated if absent.

    Returns:
        Surfaces on one network, made lazily; the first wraps the object, the last rests.

    Raises:
        ConfigurationError: There is no such method.
    """
    return METHODS[parameters.method](silhouettes, parameters, centre)
