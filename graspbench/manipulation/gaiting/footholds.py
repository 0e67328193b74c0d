"""Where on the object a finger can stand while the object turns."""

from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import BoolArray, FloatArray
from graspbench.hand import HandModel
from graspbench.hand.penetration import DEPTH_M, balls_sink, triangles_of
from graspbench.hand.shapes import FINGER
from graspbench.hand.swept import collisions
from graspbench.manipulation.gaiting.gait_parameters import GaitParameters
from graspbench.manipulation.gaiting.turning import Turning
from graspbench.reconstruction.surface import Surface

_GRID_DEG = 5.0
_MIN_SINGULAR_M = 6e-3
_MAX_TILT = 0.5
"""Of a normal out of the plane of turning: steeper contacts push the object along the axis."""
_MAX_JUMP_RAD = 0.7
_BIN_DEG = 9.0
_PER_BIN = 2
_MARGIN_CAP = 0.12
_AWAY_M = 1e3
_BENDS_RAD = (0.0, -0.5, 0.5)


@dataclass(frozen=True, eq=False)
class Foothold:
    """A place for a fingertip over a range of turns.

    Attributes:
        node: Vertex of the surface, -1 for where the finger stands already.
        point: Contact, object frame, shape (3,), m.
        normal: Outward unit normal, shape (3,).
        joints: Of the finger at the range's start, shape (k,), rad.
        cost: What speaks against it, the least first.
    """

    node: int
    point: FloatArray
    normal: FloatArray
    joints: FloatArray
    cost: float


class Footholds:
    """The nodes of a surface as places for fingertips.

    Args:
        hand: The hand.
        surface: The object's surface in the world.
        transform_object_to_world: The object's frame there, shape (4, 4).
        turning: How the object turns in the palm.
        height_m: Where the grasp's plane is along the axis, from the object's origin.
        parameters: Margins.
    """

    def __init__(
        self,
        hand: HandModel,
        surface: Surface,
        transform_object_to_world: FloatArray,
        turning: Turning,
        height_m: float,
        parameters: GaitParameters,
    ) -> None:
        pose = transform_object_to_world
        self.points = (surface.points - pose[:3, 3]) @ pose[:3, :3]
        self.normals = surface.normals @ pose[:3, :3]
        self.triangles = triangles_of(self.points, surface.network.faces)
        self._hand, self._turning, self._parameters = hand, turning, parameters
        self._axis = turning.rotation.T @ turning.axis  # it turns with the object, and so stays the same
        self._height_m = height_m
        self._alone = [_alone(hand, finger) for finger in range(hand.n_fingers)]
        self._usable = np.flatnonzero(self._touchable())

    def _touchable(self) -> BoolArray:
        """Tell where a tip can touch at all without sinking into the surface beside, and pushes inwards."""
        tilt = self.normals @ self._axis
        outwards = self.points - np.outer(self.points @ self._axis, self._axis)
        facing = np.einsum("ij,ij->i", self.normals, outwards) > 0.5 * np.linalg.norm(outwards, axis=1)
        mask: BoolArray = (np.abs(tilt) < _MAX_TILT) & facing
        sunk = np.zeros(len(self.points), dtype=np.bool_)
        radius = self._hand.tip_radius_m
        balls_sink(self.triangles, self.points + radius * self.normals, radius - 4.0 * DEPTH_M, sunk)
        return mask & ~sunk

    def over(self, finger: int, start: FloatArray, first_deg: float, last_deg: float) -> list[Foothold]:
        """Return where a finger can stand from one turn to another, a few all around, the best first.

        Args:
            finger: Which finger of the hand.
            start: Joints to search from, shape (k,).
            first_deg: Where the range begins.
            last_deg: Where it ends.
        """
        nodes = self._usable
        points, normals = self.points[nodes], self.normals[nodes]
        own = self._hand.finger_joints(finger)
        lower, upper = self._hand.lower[own], self._hand.upper[own]
        preferred = self._hand.preferred[own]
        found: list[tuple[float, int, FloatArray]] = []
        for bend_rad in _BENDS_RAD:  # the same place, the last link steeper or flatter on the surface
            begin = np.array(start if bend_rad == 0.0 else preferred)
            begin[-1:] = np.clip(begin[-1:] + bend_rad, lower[-1:], upper[-1:])
            ok, margin, course = self.reachable(
                finger, points, normals, begin, first_deg, last_deg, 0.2 if bend_rad == 0.0 else 0.0
            )
            cost = self._cost(points, normals, margin)
            found += [(float(cost[k]), int(k), course[:, k]) for k in np.flatnonzero(ok)]
        found.sort(key=lambda each: each[:2])
        angles = np.linspace(first_deg, last_deg, len(found[0][2])) if found else np.zeros(1)
        azimuths = self._azimuths(points)
        taken: dict[int, int] = {}
        chosen = []
        for price, k, course in found:
            sector = int(np.floor(azimuths[k] / _BIN_DEG))
            if taken.get(sector, 0) < _PER_BIN and self._is_clear(finger, course, angles):
                taken[sector] = taken.get(sector, 0) + 1
                chosen.append(Foothold(int(nodes[k]), points[k], normals[k], course[0], price))
        return chosen

    def reachable(
        self,
        finger: int,
        points: FloatArray,
        normals: FloatArray,
        start: FloatArray,
        first_deg: float,
        last_deg: float,
        centring: float = 0.2,
    ) -> tuple[BoolArray, FloatArray, FloatArray]:
        """Tell which contacts a finger reaches during a range of turns.

        Returns:
            Whether it does, shape (m,); its smallest joint margin, shape (m,); its joints over the range,
            shape (s, m, k).
        """
        hand, p = self._hand, self._parameters
        count = max(1, int(np.ceil(abs(last_deg - first_deg) / _GRID_DEG)))
        centres = points + hand.tip_radius_m * normals
        alive, margin = np.ones(len(points), dtype=np.bool_), np.full(len(points), np.inf)
        before = np.tile(np.asarray(start, dtype=np.float64), (len(points), 1))
        course = []
        for step in range(count + 1):
            angle = first_deg + (last_deg - first_deg) * step / count
            at = np.flatnonzero(alive)
            targets = centres[at] @ self._turning.at(angle).T + self._turning.position
            found = hand.finger_ik(finger, targets, before[at], centring=centring)
            good = (found.error_m < 1e-5) & (found.joint_margin >= p.joint_margin)
            good &= found.smallest_singular_value >= _MIN_SINGULAR_M
            if step > 0:
                good &= np.abs(found.joints - before[at]).max(axis=1) < _MAX_JUMP_RAD
            alive[at] = good
            margin[at] = np.minimum(margin[at], found.joint_margin)
            after = before.copy()
            after[at] = found.joints
            before = after
            course.append(after)
        return alive, margin, np.array(course)

    def stays(self, finger: int, foothold: Foothold, first_deg: float, last_deg: float) -> bool:
        """Return whether a finger can stay where it stands during a range of turns."""
        here = foothold.point[None], foothold.normal[None]
        ok, _, joints = self.reachable(finger, *here, foothold.joints, first_deg, last_deg)
        angles = np.linspace(first_deg, last_deg, len(joints))
        return bool(ok[0]) and self._is_clear(finger, joints[:, 0], angles)

    def _is_clear(self, finger: int, joints: FloatArray, angles_deg: FloatArray) -> bool:
        """Return whether a finger's links keep off the object at beginning, middle and end of a course."""
        alone = self._alone[finger]
        at = sorted({0, len(joints) // 2, len(joints) - 1})
        whole = np.tile(alone.preferred, (len(at), 1))
        whole[:, alone.finger_joints(finger)] = joints[at]
        palms = np.linalg.inv(np.array([self._turning.pose(angles_deg[k]) for k in at]))
        return not collisions(alone, self.triangles, palms, whole, 0, (finger,)).any()

    def _cost(self, points: FloatArray, normals: FloatArray, margin: FloatArray) -> FloatArray:
        heights = points @ self._axis
        outwards = points - np.outer(heights, self._axis)
        outwards /= np.maximum(np.linalg.norm(outwards, axis=1), 1e-9)[:, None]
        away = 1.0 - np.einsum("ij,ij->i", normals, outwards)
        tilt = (normals @ self._axis) ** 2
        off = ((heights - self._height_m) / 0.015) ** 2
        cost: FloatArray = 2.0 * away + 2.0 * tilt + 0.1 * off - 5.0 * np.minimum(margin, _MARGIN_CAP)
        return cost

    def _azimuths(self, points: FloatArray) -> FloatArray:
        across = np.cross(self._axis, np.eye(3)[int(np.argmin(np.abs(self._axis)))])
        across /= np.linalg.norm(across)
        return np.rad2deg(np.arctan2(points @ np.cross(self._axis, across), points @ across))


def _alone(hand: HandModel, finger: int) -> HandModel:
    """Return a hand whose other fingers and palm are out of everything's way."""
    local = hand.shapes.local.copy()
    local[hand.shapes.index[:, FINGER] != finger, :, 3] += _AWAY_M
    return replace(hand, shapes=hand.shapes._replace(local=local))
