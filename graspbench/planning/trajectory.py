"""The fingertips' paths: from the via configurations to the contacts (thesis 3.5)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import PlanningError
from graspbench.grasp.configuration import Grasp
from graspbench.hand.model import HandModel
from graspbench.planning.closing import closing_motion, tip_paths
from graspbench.planning.parameters import PathParameters
from graspbench.planning.smoothing import low_pass, smooth_way
from graspbench.planning.time_law import minimum_jerk

_SHARES = (1.0, 0.75, 0.5, 0.25, 0.125)
_REACH_TOLERANCE_M = 1e-5
_MIN_DEVIATION_M = 5e-3
_MIN_TRAVEL_S = 0.1  # of a way along which the tips start and stop smoothly


@dataclass(frozen=True)
class FingertipPath:
    """What one fingertip does. The tip is its foremost point, which ends on the contact.

    Attributes:
        contact: Which contact of the grasp it leads to.
        via: Surface points that the planner chose on the way (drawn yellow), shape (n, 3), m.
        times: Time of each sample, shape (t,), s; the same for all fingers.
        points: Where the tip is, shape (t, 3), m.
        normals: Outward unit normals along the path; the tip's centre is a tip radius further out, shape
            (t, 3).
        closing: First sample of the last approach; before it the tip keeps the floating distance.
        floating_distance_m: The distance it keeps, delta_f.
    """

    contact: int
    via: FloatArray
    times: FloatArray
    points: FloatArray
    normals: FloatArray
    closing: int
    floating_distance_m: float

    @property
    def approach(self) -> FloatArray:
        """The floating part of the path (drawn green), shape (closing + 1, 3)."""
        return self.points[: self.closing + 1]

    @property
    def grasp(self) -> FloatArray:
        """The last approach along the normal (drawn red), shape (t - closing, 3)."""
        return self.points[self.closing :]


def fingertip_paths(
    history: Sequence[Grasp],
    parameters: PathParameters,
    floating_distance_m: float,
    hand: HandModel | None = None,
    ground_height_m: float | None = None,
) -> tuple[FingertipPath, ...]:
    """Make smooth, timed paths through a plan's configurations.

    The configurations, lifted by the floating distance along the normals, pass a spatial filter. By default
    it looks at the whole way that led to the grasp, and takes out its loops and back-steps; with
    ``parameters.filter="causal"`` it is a first order low-pass that knows only what came before, so that it
    could run while the planner still works. The last configuration alone is reached exactly. Through the
    filtered points run cubic splines, at rest at both ends, with the same timing for all fingers. Then the
    tips close along the contact normals and all touch at the last instant.

    With a hand the paths stay within what it reaches from its grasp pose: configurations at the beginning
    that are too wide for it are left out, and the floating distance shrinks when even the last one is.
    With a ground no tip goes lower on its way than the hand's margin above it: the first ellipsoid, and what
    is lifted off an object's underside, reach below.

    Args:
        history: The plan's configurations, first to last; the last one is the grasp.
        parameters: Speed, filter and sampling.
        floating_distance_m: Distance delta_f from the surface on the way.
        hand: The hand that holds the last configuration's posture; None for no limits.
        ground_height_m: Height of the ground in the world; None for none.

    Raises:
        PlanningError: The hand cannot back away from its contacts at all.
    """
    distance, first, floor = floating_distance_m, 0, _floor(hand, ground_height_m)
    if hand is not None and hand.places_by_wrist and history[-1].posture is not None:
        return _own_paths(history, parameters, floating_distance_m, hand)
    if hand is not None and history[-1].posture is not None:
        distance, first = _within_reach(history, parameters, floating_distance_m, hand, floor)
    lifted, normals = _filtered(history[first:], parameters, distance, floor)
    approach, directions = _travel(lifted, normals, parameters)

    count = max(2, round(parameters.closing_time_s / parameters.time_step_s))
    remaining = 1.0 - minimum_jerk(np.arange(1, count + 1) / count)
    closing = history[-1].points + remaining[:, None, None] * (lifted[-1] - history[-1].points)
    whole = np.concatenate((approach, closing))
    outwards = np.concatenate((directions, np.broadcast_to(history[-1].normals, closing.shape)))
    times: FloatArray = parameters.time_step_s * np.arange(len(whole), dtype=np.float64)
    via = np.stack([grasp.points for grasp in history])
    return tuple(
        FingertipPath(
            contact=i,
            via=np.ascontiguousarray(via[:, i]),
            times=times,
            points=np.ascontiguousarray(whole[:, i]),
            normals=np.ascontiguousarray(outwards[:, i]),
            closing=len(approach) - 1,
            floating_distance_m=distance,
        )
        for i in range(via.shape[1])
    )


def _own_paths(
    history: Sequence[Grasp], parameters: PathParameters, distance: float, hand: HandModel
) -> tuple[FingertipPath, ...]:
    """Return the paths of fingers that close as their joints allow (``closing_motion``)."""
    grasp = history[-1]
    assert grasp.posture is not None
    joints = closing_motion(hand, grasp.posture, grasp.normals, distance, parameters)
    points = tip_paths(hand, grasp.posture, grasp.normals, joints)
    return tuple(
        FingertipPath(
            contact=i,
            via=np.stack([each.points[i] for each in history]),
            times=parameters.time_step_s * np.arange(len(joints), dtype=np.float64),
            points=np.ascontiguousarray(points[:, i]),
            normals=np.tile(grasp.normals[i], (len(joints), 1)),
            closing=0,
            floating_distance_m=distance,
        )
        for i in range(len(grasp.points))
    )


@dataclass(frozen=True)
class _Floor:
    """How low tips may go: the foremost point of one whose normal is level, and how much lower others may."""

    lowest_m: float
    tip_radius_m: float

    def raised(self, lifted: FloatArray, normals: FloatArray) -> FloatArray:
        """Return foremost points, none of whose tips is too low, shape (..., 3)."""
        lowest = self.lowest_m - self.tip_radius_m * normals[..., 2]
        out = lifted.copy()
        out[..., 2] = np.maximum(lifted[..., 2], lowest)
        return out


def _floor(hand: HandModel | None, ground_height_m: float | None) -> _Floor:
    if hand is None or ground_height_m is None:
        return _Floor(-np.inf, 0.0)
    return _Floor(ground_height_m + hand.margins.ground_m + hand.tip_radius_m, hand.tip_radius_m)


def _filtered(
    history: Sequence[Grasp], parameters: PathParameters, distance: float, floor: _Floor
) -> tuple[FloatArray, FloatArray]:
    """Return the filtered points, lifted by ``distance``, and their normals; shape (n, n_f, 3) each."""
    points = np.stack([grasp.points for grasp in history])
    normals = np.stack([grasp.normals for grasp in history])
    if parameters.filter == "path":
        lifted = points + distance * normals
        allowed = max(distance, _MIN_DEVIATION_M)
        lifted, normals = smooth_way(lifted, normals, parameters.max_turning_deg, allowed)
        return floor.raised(lifted, normals), normals
    points, normals = low_pass(points, parameters.filter_gain), low_pass(normals, parameters.filter_gain)
    # Only the final configuration has to be reached exactly.
    points[-1], normals[-1] = history[-1].points, history[-1].normals
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    return floor.raised(points + distance * normals, normals), normals


def _within_reach(
    history: Sequence[Grasp],
    parameters: PathParameters,
    floating_distance_m: float,
    hand: HandModel,
    floor: _Floor,
) -> tuple[float, int]:
    """Return the largest floating distance, and the first configuration, from which all fingers reach on."""
    for share in _SHARES:
        distance = share * floating_distance_m
        if not _reaches(history[-1:], parameters, distance, hand, floor):
            continue
        # The further back, the wider: bisect for the earliest beginning that is within reach.
        unreached, first = -1, len(history) - 1
        while first - unreached > 1:
            middle = (first + unreached) // 2
            if _reaches(history[middle:], parameters, distance, hand, floor):
                first = middle
            else:
                unreached = middle
        return distance, first
    raise PlanningError(
        f"the fingers of hand '{hand.name}' cannot back away from their contacts by "
        f"{1e3 * _SHARES[-1] * floating_distance_m:.1f} mm",
        remedy="lower planner.floating_distance_m",
    )


def _reaches(
    history: Sequence[Grasp], parameters: PathParameters, distance: float, hand: HandModel, floor: _Floor
) -> bool:
    posture = history[-1].posture
    assert posture is not None
    lifted, normals = _travel(*_filtered(history, parameters, distance, floor), parameters)
    # Between the configurations too, and at both ends.
    few = np.unique(np.linspace(0, len(lifted) - 1, 4 * len(history)).round().astype(np.int64))
    lifted, normals = lifted[few], normals[few]
    to_world = posture.transform_palm_to_world
    targets = (lifted + hand.tip_radius_m * normals - to_world[:3, 3]) @ to_world[:3, :3]
    for i, finger in enumerate(posture.fingers):
        start = posture.joints[hand.finger_joints(finger)]
        solved = hand.finger_ik(finger, targets[:, i], start, centring=0.0)
        if np.any(solved.error_m > _REACH_TOLERANCE_M) or np.any(
            solved.smallest_singular_value < 0.5 * hand.margins.singular_value_m
        ):
            return False
    return True


def _travel(
    lifted: FloatArray, normals: FloatArray, parameters: PathParameters
) -> tuple[FloatArray, FloatArray]:
    """Sample the floating paths and their normals in time, shape (t, n_f, 3) each."""
    keep = [0]
    for k in range(1, len(lifted)):
        # Points that coincide add nothing, and would make the spline's parameter stand still.
        if np.linalg.norm(lifted[k] - lifted[keep[-1]], axis=1).max() > 1e-4:
            keep.append(k)
    if keep[-1] != len(lifted) - 1:
        keep[-1] = len(lifted) - 1
    if len(keep) < 2:
        return lifted[-1:], normals[-1:]
    lengths = np.linalg.norm(np.diff(lifted[keep], axis=0), axis=2).max(axis=1)
    knots = np.concatenate(([0.0], np.cumsum(lengths)))
    duration = max(knots[-1] / parameters.tip_speed_m_s, _MIN_TRAVEL_S)
    count = max(2, round(duration / parameters.time_step_s))
    along = knots[-1] * minimum_jerk(np.arange(count + 1) / count)
    # Loading scipy's interpolation takes long, and only who asks for paths needs it.
    from scipy.interpolate import CubicSpline

    both = np.stack((lifted[keep], normals[keep]), axis=1)
    sampled = CubicSpline(knots, both, axis=0, bc_type="natural")(along)
    directions = sampled[:, 1] / np.linalg.norm(sampled[:, 1], axis=-1, keepdims=True)
    return sampled[:, 0], directions
