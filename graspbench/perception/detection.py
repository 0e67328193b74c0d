"""The detection pass: turn the camera until its optical axis meets the object (thesis 3.2.1)."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ImageError, StationError
from graspbench.perception.camera import View, look_at
from graspbench.perception.segmentation import SilhouetteParameters, silhouettes
from graspbench.perception.silhouette import Silhouette
from graspbench.perception.stations import Station, StationParameters
from graspbench.perception.triangulation import triangulate_centre

_MAX_ROUNDS = 6
_SETTLED_M = 1e-3
_TREMBLING_M = 2e-2
_STEPS_BACK = (1.0, 1.5)
"""Times the wide views' distance."""

_SLANTS_DEG = ((0.0, 0.0), (45.0, 0.0), (45.0, 90.0))


class Detection(NamedTuple):
    """Where the object is, and how large.

    Attributes:
        centre: Estimated centre in the world, shape (3,).
        radius_m: Radius of a ball around it that holds what the wide views show.
    """

    centre: FloatArray
    radius_m: float


def detect_object(
    take: Callable[[Station], View], parameters: StationParameters, blobs: SilhouetteParameters
) -> Detection:
    """Find the object's centre and size by blob analysis in wide views.

    The camera starts above the table's origin. Each round looks at the present guess from above and
    from two sides and moves the guess to where the rays through the blobs' centroids meet, until it stays
    there: then the optical axes pass as near to the centroids as one point allows.

    Args:
        take: Moves the camera to a station and returns its image.
        parameters: Distance of the wide views.
        blobs: How a blob is told from the background.

    Raises:
        ImageError: No object, or no single one, is in view, from farther off neither.
        StationError: The optical axis does not come to rest on the object.
    """
    guess = np.zeros(3)
    for round_number in range(_MAX_ROUNDS):
        # The first guess has no height yet: the view from above alone is sure to be near.
        slants = _SLANTS_DEG[:1] if round_number == 0 else _SLANTS_DEG
        found = _look(take, guess, slants, parameters.home_distance_m, blobs)
        if round_number == 0:
            ray = found[0].camera.rays(found[0].centroid[None])[0]
            origin = found[0].camera.position
            guess = origin - ray * (origin[2] / ray[2])
            continue
        previous, guess = guess, triangulate_centre(found)
        moved = float(np.linalg.norm(guess - previous))
        if moved < _SETTLED_M:
            return Detection(guess, _radius(found, guess))
    # Uncertain poses of the camera keep the guess trembling; it is still good enough to place stations.
    if moved < _TREMBLING_M:
        return Detection(guess, _radius(found, guess))
    raise StationError(
        f"the optical axis still moves by {1e3 * moved:.1f} mm after {_MAX_ROUNDS} looks at the object",
        remedy="check that the object does not move and that the camera is calibrated",
        moved_m=moved,
    )


def _look(
    take: Callable[[Station], View],
    guess: FloatArray,
    slants: Sequence[tuple[float, float]],
    distance_m: float,
    blobs: SilhouetteParameters,
) -> tuple[Silhouette, ...]:
    """Return the silhouettes of wide views; from farther off where the object does not fit into these.

    While the guess is still on the ground a tall object sticks out of the slanted views, or so far into their
    borders that it is taken for background.
    """
    first: ImageError | None = None
    for factor in _STEPS_BACK:
        views = [take(wide_station(i, guess, slant, factor * distance_m)) for i, slant in enumerate(slants)]
        try:
            return silhouettes(views, blobs)
        except ImageError as error:
            first = first or error
    assert first is not None
    raise ImageError(
        f"the detection pass fails: {first.what}",
        remedy="put one object in view (scene.x_m, scene.y_m), or raise stations.home_distance_m",
        **first.data,
    ) from first


def _radius(found: Sequence[Silhouette], centre: FloatArray) -> float:
    """Return the radius of the smallest ball about the centre whose cones hold all silhouettes."""
    return max(enclosing_radius_m(silhouette, centre) for silhouette in found)


def enclosing_radius_m(silhouette: Silhouette, centre: FloatArray) -> float:
    """Return the radius of the smallest ball about a centre whose cone holds a silhouette."""
    rows, columns = np.nonzero(silhouette.mask)
    rays = silhouette.camera.rays(np.column_stack((columns + 0.5, rows + 0.5)))
    towards = centre - silhouette.camera.position
    distance = float(np.linalg.norm(towards))
    cosine = float((rays @ (towards / distance)).min())
    return distance * float(np.sqrt(1.0 - cosine**2))


def wide_station(number: int, target: FloatArray, slant: tuple[float, float], distance_m: float) -> Station:
    """Return a station at the wide views' distance, slanted by angle and azimuth in degrees."""
    angle, azimuth = np.radians(slant)
    direction = np.array([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)])
    return Station(f"wide-{number}", look_at(target + distance_m * direction, target))
