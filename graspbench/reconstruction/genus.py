"""Which holes a reconstruction method can carry: the one place that says so."""

from collections.abc import Sequence

from graspbench.perception.silhouette import Silhouette, without_holes

_MAX_GENUS = {"elastic": 0, "radial": 0}
"""Their networks are spheres; methods that are not named here carry any genus."""

SPHERE_METHOD, ANY_GENUS_METHOD = "elastic", "hull_net"


def max_genus(method: str) -> int | None:
    """Return the largest genus that a method's surfaces have; None for any.

    Args:
        method: Its registered name; ``auto`` and methods of others count as able to carry any.
    """
    return _MAX_GENUS.get(method)


def carried_by(method: str, silhouettes: Sequence[Silhouette]) -> tuple[Silhouette, ...]:
    """Return the silhouettes as a method takes them: with their holes filled if its surfaces have none."""
    return without_holes(silhouettes) if max_genus(method) == 0 else tuple(silhouettes)


def method_for(silhouettes: Sequence[Silhouette]) -> str:
    """Return the method that carries what the silhouettes show: the thesis' where no hole is seen."""
    return ANY_GENUS_METHOD if any(silhouette.holes for silhouette in silhouettes) else SPHERE_METHOD
