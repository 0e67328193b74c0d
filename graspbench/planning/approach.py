"""The hand's way to its grasp, clear of object and ground where one of a few ways is.

The thesis' way leads through the configurations that the planner went through. While the surface shrinks
they lie around it, but a finger may cross a handle or a corner between two of them, or when the hand arrives.
Then shorter ways are tried, down to the grasp's own contacts lifted along their normals, and arrivals from
farther off. The first way on which neither links nor fingertips run into the surface or the ground is taken;
where there is none, the one with the fewest samples inside them.
"""

from collections.abc import Sequence
from dataclasses import replace

from graspbench.errors import PlanningError
from graspbench.grasp.configuration import Grasp
from graspbench.hand.model import HandModel
from graspbench.hand.penetration import triangles_of
from graspbench.hand.posture import HandPosture
from graspbench.hand.swept import collisions
from graspbench.planning.parameters import AnyPlannerParameters
from graspbench.planning.tracking import JointPath, track
from graspbench.planning.trajectory import FingertipPath, fingertip_paths
from graspbench.reconstruction.surface import Surface

_EVERY_S = 0.02
_LONG_RETREATS = 4.0
"""Times the usual retreat."""

_SHARES_OF_THE_WAY = (1.0, 0.5, 0.25, 0.0)


def clear_approach(
    history: Sequence[Grasp],
    surface: Surface,
    hand: HandModel,
    planner: AnyPlannerParameters,
    ground_height_m: float | None = None,
) -> tuple[tuple[FingertipPath, ...], JointPath]:
    """Plan the fingertips' way to their contacts and the hand's motion along it.

    Args:
        history: The plan's configurations, first to last; the last one is the grasp, with its posture.
        surface: The surface at rest, an obstacle.
        hand: The hand.
        planner: Floating distance and how paths are made.
        ground_height_m: Height of the ground, an obstacle; None for none.

    Raises:
        PlanningError: The hand cannot follow any way to its grasp.
    """
    posture = history[-1].posture
    assert posture is not None, "a plan made with a checker has a posture"
    triangles = triangles_of(surface.points, surface.network.faces)
    best: tuple[float, tuple[tuple[FingertipPath, ...], JointPath]] | None = None
    refused: PlanningError | None = None
    for part in _parts(history):
        for retreat in (1.0, _LONG_RETREATS):
            paths = replace(planner.paths, retreat_m=retreat * planner.paths.retreat_m)
            try:
                way = _way(part, hand, posture, replace(planner, paths=paths), ground_height_m)
            except PlanningError as error:
                refused = refused or error
                break
            motion = way[1]
            stride = max(1, round(_EVERY_S / planner.paths.time_step_s))
            sunk = collisions(
                hand,
                triangles,
                motion.transform_palm_to_world[::stride],
                motion.joints[::stride],
                motion.closing // stride,
                posture.fingers,
                ground_height_m,
            ).mean()
            if best is None or sunk < best[0]:
                best = float(sunk), way
            if sunk == 0.0:
                return way
    if best is None:
        assert refused is not None
        raise refused
    return best[1]


def _parts(history: Sequence[Grasp]) -> list[Sequence[Grasp]]:
    """Return the whole way and shorter ends of it, the longest first."""
    firsts = [round((1.0 - share) * (len(history) - 1)) for share in _SHARES_OF_THE_WAY]
    return [history[first:] for first in dict.fromkeys(firsts)]


def _way(
    history: Sequence[Grasp],
    hand: HandModel,
    posture: HandPosture,
    planner: AnyPlannerParameters,
    ground_height_m: float | None,
) -> tuple[tuple[FingertipPath, ...], JointPath]:
    paths = fingertip_paths(history, planner.paths, planner.floating_distance_m, hand, ground_height_m)
    return paths, track(paths, hand, posture, planner.paths)
