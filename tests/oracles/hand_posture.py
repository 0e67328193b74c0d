"""A hand's posture judged by Pinocchio and Coal alone, from its URDF and its description.

Nothing of graspbench's kinematics, shapes or distances is used: a posture that it calls feasible has to
stand before this.
"""

from dataclasses import dataclass
from itertools import combinations

import coal
import numpy as np
import pinocchio
import trimesh
from scipy.spatial import ConvexHull, HalfspaceIntersection

from graspbench.hand import HandModel, HandParameters

DEPTH_M = 1e-4


@dataclass(frozen=True)
class Judgement:
    """What a posture does wrong, in numbers; a depth is negative by how far bodies overlap.

    Attributes:
        tip_error_m: Largest distance of a tip's centre from its place.
        outside_rad: Largest excess of a joint over its limits.
        singular_value_m: Smallest singular value of a used finger's Jacobian.
        hand_depth_m: Deepest overlap of two links, or of a link and the palm.
        ground_depth_m: Deepest overlap with the ground.
        object_depth_m: Deepest overlap of palm or links with the object, fingertips apart.
        tip_depth_m: Deepest overlap of a fingertip with the object.
    """

    tip_error_m: float
    outside_rad: float
    singular_value_m: float
    hand_depth_m: float
    ground_depth_m: float
    object_depth_m: float
    tip_depth_m: float

    def faults(self, singular_value_m: float) -> list[str]:
        """Name what breaks the limits: 0.1 mm, the joints' ranges, the least singular value."""
        checks = {
            "tip error": self.tip_error_m <= DEPTH_M,
            "joint limit": self.outside_rad <= 0.0,
            "singularity": self.singular_value_m >= singular_value_m,
            "hand": self.hand_depth_m <= DEPTH_M,
            "ground": self.ground_depth_m <= DEPTH_M,
            "object": self.object_depth_m <= DEPTH_M,
            "tip in object": self.tip_depth_m <= DEPTH_M,
        }
        return [name for name, good in checks.items() if not good]


def judge(parameters: HandParameters, hand: HandModel, posture, points, normals, mesh, ground=0.0):
    """Judge a posture.

    Args:
        parameters: The hand's description.
        hand: Where its URDF, its names and its preferred posture are; nothing else of it is used.
        posture: The posture.
        points: Contact points, shape (m, 3).
        normals: Outward unit normals, shape (m, 3).
        mesh: The object, closed; None for none.
        ground: Height of the ground; None for none.
    """
    folders = [str(folder) for folder in hand.package_dirs]
    model = pinocchio.buildModelFromUrdf(str(hand.urdf_path), mimic=True)
    shapes = pinocchio.buildGeomFromUrdf(
        model, str(hand.urdf_path), pinocchio.GeometryType.COLLISION, package_dirs=folders
    )
    data, at = model.createData(), shapes.createData()
    pinocchio.updateGeometryPlacements(model, data, shapes, at, posture.joints)
    pinocchio.computeJointJacobians(model, data, posture.joints)
    pinocchio.updateFramePlacements(model, data)
    root = pinocchio.SE3(posture.transform_palm_to_world) * _palm(parameters, hand, model).inverse()
    placements = [root * placement for placement in at.oMg]

    errors, values, tips, ends = [], [], [], set()
    as_links = parameters.tip_shape == "link"
    for contact, finger in enumerate(posture.fingers):
        frame = model.getFrameId(hand.tip_links[finger])
        tips.append(root.act(data.oMf[frame].translation))
        jacobian = pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED)
        jacobian = jacobian.reshape(6, -1)
        if as_links:
            joint = model.frames[frame].parentJoint
            ends.add(joint)
            own = [i for i, item in enumerate(shapes.geometryObjects) if item.parentJoint == joint]
            errors.append(
                min(_gap(shapes.geometryObjects[i].geometry, placements[i], points[contact]) for i in own)
            )
            arm = root.rotation.T @ (points[contact] - tips[-1])
            jacobian = jacobian[:3] + np.cross(jacobian[3:], arm, axisa=0, axisc=0)
        else:
            errors.append(
                np.linalg.norm(tips[-1] - points[contact] - parameters.tip_radius_m * normals[contact])
            )
            jacobian = jacobian[:3]
        free = _freedom(model, frame)
        values.append(np.linalg.svd(jacobian.reshape(3, -1), compute_uv=False)[free - 1])
    excess = np.maximum(model.lowerPositionLimit - posture.joints, posture.joints - model.upperPositionLimit)
    is_tip = [
        item.parentJoint in ends
        if as_links
        else isinstance(item.geometry, coal.Sphere)
        and any(np.linalg.norm(p.translation - tip) < 1e-3 for tip in tips)
        for item, p in zip(shapes.geometryObjects, placements, strict=True)
    ]
    items = list(zip(shapes.geometryObjects, placements, is_tip, strict=True))
    surface = None if mesh is None else bounding_surface(mesh)
    return Judgement(
        tip_error_m=float(max(errors)),
        outside_rad=float(excess.max()),
        singular_value_m=float(min(values)),
        hand_depth_m=_deepest_pair(model, shapes, placements, hand.preferred),
        ground_depth_m=-np.inf
        if ground is None
        else max(_ground_depth(i.geometry, p, ground) for i, p, _ in items),
        object_depth_m=max(
            (_depth(i.geometry, p, surface, mesh) for i, p, tip in items if not tip), default=0.0
        )
        if mesh is not None
        else 0.0,
        tip_depth_m=0.0
        if mesh is None
        else max(_depth(i.geometry, p, surface, mesh) for i, p, tip in items if tip)
        if as_links
        else max(_ball_depth(tip, parameters.tip_radius_m, surface, mesh) for tip in tips),
    )


def _gap(shape, placement, point) -> float:
    """Return how far a point is from the surface of a shape, of a mesh of its convex hull."""
    local = placement.actInv(np.asarray(point, dtype=float))
    if hasattr(shape, "vertices"):
        hull = ConvexHull(np.array(shape.vertices(), dtype=float).reshape(-1, 3))
        body = trimesh.Trimesh(hull.points, hull.simplices, process=False)
        return float(trimesh.proximity.closest_point_naive(body, local[None])[1][0])
    grain = 1e-6
    here = pinocchio.SE3(np.eye(3), local)
    return abs(_distance(shape, pinocchio.SE3.Identity(), coal.Sphere(grain), here) + grain)


def depth_in_object(hand: HandModel, joints, transform_palm_to_world, mesh, with_tips: bool) -> float:
    """Return how deep palm and links are in an object at most; spheres are tips."""
    data, at = hand.model.createData(), hand.geometry.createData()
    pinocchio.updateGeometryPlacements(hand.model, data, hand.geometry, at, joints)
    root = pinocchio.SE3(transform_palm_to_world @ np.linalg.inv(hand.transform_palm_to_root))
    surface = bounding_surface(mesh)
    return max(
        _depth(item.geometry, root * placement, surface, mesh)
        for item, placement in zip(hand.geometry.geometryObjects, at.oMg, strict=True)
        if with_tips or not isinstance(item.geometry, coal.Sphere)
    )


def _palm(parameters, hand, model):
    frame = model.frames[model.getFrameId(hand.palm_link)]
    if parameters.kind == "radial":
        return pinocchio.SE3(hand.transform_palm_to_root)
    turn = pinocchio.rpy.rpyToMatrix(*np.radians(parameters.palm.rpy_deg))
    return frame.placement * pinocchio.SE3(turn, np.array(parameters.palm.xyz_m))


def bounding_surface(mesh: trimesh.Trimesh):
    body = coal.BVHModelOBBRSS()
    body.beginModel(len(mesh.faces), len(mesh.vertices))
    body.addVertices(np.asarray(mesh.vertices))
    body.addTriangles(np.asarray(mesh.faces, dtype=np.uint32))
    body.endModel()
    return body


def _distance(shape_a, a, shape_b, b) -> float:
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    to_a = coal.Transform3s(a.rotation, a.translation)
    return float(
        coal.distance(shape_a, to_a, shape_b, coal.Transform3s(b.rotation, b.translation), request, result)
    )


def _hits(shape, placement, surface) -> bool:
    at = coal.Transform3s(placement.rotation, placement.translation)
    return (
        coal.collide(
            shape, at, surface, coal.Transform3s.Identity(), coal.CollisionRequest(), coal.CollisionResult()
        )
        > 0
    )


def _freedom(model, frame) -> int:
    """Return in how many directions a tip can move at most, in some posture or other."""
    data, generator = model.createData(), np.random.default_rng(7)
    most = 0
    for _ in range(5):
        q = generator.uniform(model.lowerPositionLimit, model.upperPositionLimit)
        pinocchio.computeJointJacobians(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        jacobian = pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED)
        values = np.linalg.svd(jacobian.reshape(6, -1)[:3], compute_uv=False)
        most = max(most, int(np.sum(values > 1e-6)))
    return most


def _ground_depth(shape, placement, height) -> float:
    plane = coal.Halfspace(np.array([0.0, 0.0, 1.0]), height)
    return -_distance(shape, placement, plane, pinocchio.SE3.Identity())


def _depth(shape, placement, surface, mesh) -> float:
    """Return by how much a shape must be thinned to leave the surface, by bisection; 0 if outside."""
    if _inside(mesh, placement.translation):
        return float("inf")
    if not _hits(shape, placement, surface):
        return 0.0
    low, high = 0.0, _thickness(shape)
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (middle, high) if _hits(_thinned(shape, middle), placement, surface) else (low, middle)
    return high


def _thickness(shape) -> float:
    if isinstance(shape, coal.Box):
        return float(np.min(shape.halfSide)) - 1e-5
    if isinstance(shape, coal.Cylinder):
        return min(float(shape.radius), float(shape.halfLength)) - 1e-5
    if hasattr(shape, "vertices"):
        return 0.01
    return float(shape.radius) - 1e-5


def _thinned(shape, by: float):
    if isinstance(shape, coal.Box):
        return coal.Box(*(2 * (np.asarray(shape.halfSide) - by)))
    if isinstance(shape, coal.Cylinder):
        return coal.Cylinder(shape.radius - by, 2 * (shape.halfLength - by))
    if isinstance(shape, coal.Capsule):
        return coal.Capsule(shape.radius - by, 2 * shape.halfLength)
    if hasattr(shape, "vertices"):
        return _thinned_hull(np.array(shape.vertices(), dtype=float).reshape(-1, 3), by)
    return coal.Sphere(shape.radius - by)


def _thinned_hull(vertices, by: float):
    """Return what is left of a mesh's hull when its planes are moved inwards; a grain if nothing is."""
    hull = ConvexHull(vertices)
    planes = hull.equations + np.array([0.0, 0.0, 0.0, by])
    inside = vertices[hull.vertices].mean(axis=0)
    if np.max(planes[:, :3] @ inside + planes[:, 3]) > -1e-6:
        return coal.Sphere(1e-6)
    kept = HalfspaceIntersection(planes, inside).intersections
    return bounding_surface(trimesh.Trimesh(kept, ConvexHull(kept).simplices))


def _ball_depth(centre, radius, surface, mesh) -> float:
    if _inside(mesh, centre):
        return float("inf")
    grain = 1e-6
    here = pinocchio.SE3(np.eye(3), centre)
    return radius - grain - _distance(coal.Sphere(grain), here, surface, pinocchio.SE3.Identity())


def _inside(mesh: trimesh.Trimesh, point) -> bool:
    """Tell by the surface's solid angle whether a point is inside."""
    a, b, c = np.moveaxis(np.asarray(mesh.triangles) - point, 1, 0)
    u, v, w = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (a, b, c))
    top = np.einsum("ij,ij->i", u, np.cross(v, w))
    bottom = 1 + np.einsum("ij,ij->i", u, v) + np.einsum("ij,ij->i", v, w) + np.einsum("ij,ij->i", w, u)
    return bool(abs(2 * np.arctan2(top, bottom).sum()) > 2 * np.pi)


def _deepest_pair(model, shapes, placements, preferred) -> float:
    """Return the deepest overlap of links that are neither joined nor overlap in the preferred posture."""
    data, at = model.createData(), shapes.createData()
    pinocchio.updateGeometryPlacements(model, data, shapes, at, preferred)
    items, deepest = shapes.geometryObjects, -np.inf
    touching = set()
    for a, b in combinations(range(len(items)), 2):
        bodies = frozenset((items[a].parentJoint, items[b].parentJoint))
        if _distance(items[a].geometry, at.oMg[a], items[b].geometry, at.oMg[b]) < 0.0:
            touching.add(bodies)
    for a, b in combinations(range(len(items)), 2):
        i, j = items[a].parentJoint, items[b].parentJoint
        joined = i == j or model.parents[i] == j or model.parents[j] == i
        if joined or frozenset((i, j)) in touching:
            continue
        deepest = max(deepest, -_distance(items[a].geometry, placements[a], items[b].geometry, placements[b]))
    return deepest
