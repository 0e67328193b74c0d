"""Hand and object as convex bodies, and the signed distance of a hand's links from the object.

Pinocchio's kinematics and Coal's distances; nothing of what plans grasps is used. The object is the union of
the convex parts that the physics has too; links of meshes are their convex hulls, as they are there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import coal
import numpy as np
import pinocchio

from graspbench.arrays import FloatArray, IntArray
from graspbench.geometry.model import ObjectModel
from graspbench.hand.chains import SLIDES, VECTOR_RATIO
from graspbench.hand.model import HandModel
from graspbench.hand.verification import link_of_shapes


@dataclass(frozen=True, eq=False)
class Nearness:
    """How near a shape of the hand is to the object.

    Attributes:
        distance_m: Signed: negative by the depth of the deepest overlap with a convex part.
        point: The object's nearest point (when they overlap: its deepest one), object frame, shape (3,).
        normal: Outward unit normal of the object there, shape (3,).
    """

    distance_m: float
    point: FloatArray
    normal: FloatArray


class HandBodies:
    """The collision shapes of a hand, placed by its joints.

    Args:
        hand: The hand.

    Attributes:
        hand: The hand.
        links: Finger and position in its chain of each shape's link, (-1, -1) for the palm; shape (s, 2).
    """

    def __init__(self, hand: HandModel) -> None:
        self.hand = hand
        self.links: IntArray = np.array(link_of_shapes(hand), dtype=np.int64)
        items = list(hand.geometry.geometryObjects)
        self.shapes = [_convex(item.geometry) for item in items]
        self.parents = [item.parentJoint for item in items]
        self._placements = [item.placement for item in items]
        for shape in self.shapes:
            shape.computeLocalAABB()
        self.radii = np.array([shape.aabb_radius for shape in self.shapes])
        self._centres = np.array([shape.aabb_center for shape in self.shapes])
        self._data = hand.model.createData()
        self._root_in_palm = pinocchio.SE3(hand.transform_palm_to_root).inverse()

    def place(
        self, transform_palm_to_object: FloatArray, joints: FloatArray, which: Sequence[int] | None = None
    ) -> list[pinocchio.SE3]:
        """Return the poses of some shapes, all by default, in the object's frame."""
        pinocchio.forwardKinematics(self.hand.model, self._data, joints)
        root = pinocchio.SE3(transform_palm_to_object) * self._root_in_palm
        chosen = range(len(self.shapes)) if which is None else which
        return [root * self._data.oMi[self.parents[i]] * self._placements[i] for i in chosen]

    @cached_property
    def levers(self) -> FloatArray:
        """How far a point of each shape moves at most per unit of each joint, shape (s, n_q), m/rad."""
        chains = self.hand.chains
        levers = np.zeros((len(self.shapes), self.hand.n_joints))
        for shape, (finger, link) in enumerate(self.links):
            for k in range(link + 1):
                ratio = abs(chains.limits[finger, k, VECTOR_RATIO])
                slides = chains.kinds[finger, k, SLIDES] == 1
                lever = 1.0 if slides else self._lever(shape, self.hand.chain_joints[finger][k])
                levers[shape, chains.index[finger, k]] += ratio * lever
        return levers

    def point_jacobian(
        self,
        transform_palm_to_object: FloatArray,
        joints: FloatArray,
        finger: int,
        link: int,
        point: FloatArray,
    ) -> FloatArray:
        """Return the Jacobian of a point of a link, in the object's frame, shape (3, n_q), m/rad.

        Args:
            transform_palm_to_object: The palm, shape (4, 4).
            joints: Shape (n_q,).
            finger: The link's finger, -1 for the palm.
            link: Position of its joint in the finger's chain.
            point: The point, object frame, shape (3,).
        """
        if finger < 0:
            return np.zeros((3, self.hand.n_joints))
        joint = self.hand.chain_joints[finger][link]
        pinocchio.computeJointJacobians(self.hand.model, self._data, joints)
        jacobian = pinocchio.getJointJacobian(
            self.hand.model, self._data, joint, pinocchio.LOCAL_WORLD_ALIGNED
        ).reshape(6, -1)
        root = pinocchio.SE3(transform_palm_to_object) * self._root_in_palm
        arm = root.actInv(point) - self._data.oMi[joint].translation
        return np.asarray(root.rotation @ (jacobian[:3] - pinocchio.skew(arm) @ jacobian[3:]))

    def _lever(self, shape: int, joint: int) -> float:
        """Return how far a point of a shape can be from a joint of Pinocchio's that carries it, m."""
        model, at = self.hand.model, self.parents[shape]
        length = float(np.linalg.norm(self._placements[shape].act(self._centres[shape])) + self.radii[shape])
        while at not in (joint, 0):
            length += float(np.linalg.norm(model.jointPlacements[at].translation))
            if model.joints[at].nq == 1 and "P" in model.joints[at].shortname().removeprefix("JointModel"):
                q = model.joints[at].idx_q
                length += float(max(abs(model.lowerPositionLimit[q]), abs(model.upperPositionLimit[q])))
            at = model.parents[at]
        return length

    def balls(self, shapes: Sequence[int], poses: Sequence[pinocchio.SE3]) -> FloatArray:
        """Return centres and radii of balls around some shapes, shape (n, 4)."""
        rows = np.empty((len(shapes), 4))
        for i, (shape, pose) in enumerate(zip(shapes, poses, strict=True)):
            rows[i, :3] = pose.rotation @ self._centres[shape] + pose.translation
        rows[:, 3] = self.radii[list(shapes)]
        return rows


class ObjectBody:
    """An object as a union of convex parts.

    Args:
        object_model: The object.
    """

    def __init__(self, object_model: ObjectModel) -> None:
        self.parts = [_hull(np.asarray(part.vertices)) for part in object_model.collision_parts]
        for part in self.parts:
            part.computeLocalAABB()
        self._centres = np.array([part.aabb_center for part in self.parts])
        self._radii = np.array([part.aabb_radius for part in self.parts])
        self._request = coal.DistanceRequest()
        self._request.enable_signed_distance = True
        self._result = coal.DistanceResult()
        self._here = coal.Transform3s.Identity()

    def gaps(self, balls: FloatArray) -> FloatArray:
        """Return lower bounds of the distances of balls, shape (n, 4), from the parts, shape (n, parts)."""
        apart = balls[:, None, :3] - self._centres
        distances = np.sqrt(np.einsum("npi,npi->np", apart, apart))
        return np.asarray(distances - self._radii - balls[:, 3:])

    def nearness(
        self,
        shape: coal.CollisionGeometry,
        pose: pinocchio.SE3,
        gaps: FloatArray,
        enough_m: float = np.inf,
    ) -> tuple[Nearness | None, float]:
        """Return how near a shape is to the object, and what it is not nearer than, m.

        Args:
            shape: A convex shape.
            pose: Its pose in the object's frame.
            gaps: Its row of `gaps`, shape (parts,).
            enough_m: How near it is, is None where it is farther away than this.
        """
        nearest = float(gaps.min())
        if nearest >= enough_m:
            return None, nearest
        least, bound, found = enough_m, np.inf, None
        at, result = coal.Transform3s(pose.rotation, pose.translation), self._result
        for part in np.argsort(gaps).tolist():
            if gaps[part] >= least:
                bound = min(bound, float(gaps[part]))
                break
            result.clear()
            distance = coal.distance(shape, at, self.parts[part], self._here, self._request, result)
            bound = min(bound, float(distance))
            if distance < least:
                least = float(distance)
                found = Nearness(least, np.array(result.getNearestPoint2()), -np.array(result.normal))
        return found, bound


def _convex(shape: Any) -> Any:
    """Return a shape as it is when it is convex, else its convex hull."""
    if isinstance(shape, coal.BVHModelBase):
        return _hull(np.asarray(shape.vertices(), dtype=np.float64).reshape(-1, 3))
    return shape


def _hull(vertices: FloatArray) -> Any:
    points = coal.StdVec_Vec3s()
    for vertex in vertices:
        points.append(vertex)
    return coal.ConvexBase.convexHull(points, False, "Qt")
