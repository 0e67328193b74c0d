"""What the pictures of a planned trial show, for whoever draws them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # whoever draws need not load the stages
    from graspbench.grasp import Grasp, GraspQuality
    from graspbench.hand import HandModel
    from graspbench.planning import FingertipPath
    from graspbench.reconstruction import Surface
    from graspbench.record.parameters import RecordParameters
    from graspbench.trial.planned import PlannedTrial


@dataclass(frozen=True)
class PlannedPictures:
    """What the pictures of a planned trial show; all of it can be pickled.

    Attributes:
        title: First line of the grasp's pictures.
        surface: The reconstructed surface at rest.
        hand: The hand.
        grasp: The grasp that is executed.
        quality: Its measures.
        paths: The fingertips' paths.
        wanted: How they are drawn.
    """

    title: str
    surface: "Surface"
    hand: "HandModel"
    grasp: "Grasp"
    quality: "GraspQuality"
    paths: "tuple[FingertipPath, ...]"
    wanted: "RecordParameters"


def planned_pictures(
    trial: "PlannedTrial", paths: "Sequence[FingertipPath]", index: str, wanted: "RecordParameters"
) -> PlannedPictures:
    """Return what the pictures of a planned trial show.

    Args:
        trial: The trial.
        paths: Its fingertip paths.
        index: The index's name.
        wanted: How they are drawn.
    """
    return PlannedPictures(
        title=f"{trial.name}, {trial.hand.name} hand, {index}",
        surface=trial.surfaces[-1],
        hand=trial.hand,
        grasp=trial.executed.grasp,
        quality=trial.executed.quality,
        paths=tuple(paths),
        wanted=wanted,
    )
