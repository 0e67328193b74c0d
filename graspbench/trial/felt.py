"""What exploring touches found against what is true, and the error of pose that they are to make good."""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from graspbench.arrays import FloatArray
from graspbench.geometry import ObjectModel
from graspbench.geometry.distance import distances_to_mesh
from graspbench.grasp import QualityParameters
from graspbench.grasp.measure import evaluate_measures
from graspbench.reconstruction import Surface
from graspbench.reconstruction.felt_surface import planar_transform
from graspbench.results.physical_results import TouchResult
from graspbench.simulation.execution_result import ExecutionResult
from graspbench.simulation.scene import SceneParameters
from graspbench.simulation.world import World
from graspbench.trial.planned import Scene

_STREAM = 71
"""Keeps this draw apart from others of the same seed."""

_NEAR_M = 0.006


def shift_unseen(world: World, scene: SceneParameters, seed: int) -> None:
    """Shift and turn the object on the table after it was seen, as the scene asks and the seed draws."""
    if scene.unseen_shift_mm == 0.0 and scene.unseen_turn_deg == 0.0:
        return
    pose = world.object_pose()
    generator = np.random.default_rng((seed, _STREAM))
    way, sign = generator.uniform(0.0, 2.0 * np.pi), 1.0 if generator.uniform() < 0.5 else -1.0
    length = 1e-3 * scene.unseen_shift_mm
    shift = np.array([length * np.cos(way), length * np.sin(way), sign * np.radians(scene.unseen_turn_deg)])
    world.put_object(planar_transform(pose[:3, 3], shift) @ pose)


def true_q3(
    model: ObjectModel, execution: ExecutionResult, quality: QualityParameters, surface: Surface
) -> float | None:
    """Return Q3 of the contacts that were really made, about the object's true centre of mass.

    Points and normals are those of the simulation's first touches; the torque length is the plan's, so that
    the planned and the true value can be compared.
    """
    if execution.contacts is None:
        return None
    points, normals = execution.contacts[:, 0], execution.contacts[:, 1]
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    centre = np.zeros(3)  # the object frame's origin is its centre of mass
    return float(evaluate_measures(("q3",), points, normals, centre, quality, length_m)["q3"])


def felt_result(scene: Scene, surface: Surface, execution: ExecutionResult) -> TouchResult | None:
    """Return what touches found beside the truth; None without touches."""
    found = execution.explored
    if found is None:
        return None
    seen, belief = scene.transform_object_to_world, found.belief
    nothing = _pose_error(found.pose_before, seen, np.eye(4), belief.pivot)
    after = _pose_error(found.pose_after, seen, belief.transform, belief.pivot)
    before_mm, after_mm = _near_felt(scene, surface, execution)
    return TouchResult(
        touches=len(found.felt),
        tried=found.tried,
        time_s=found.time_s,
        shift_mm=1e3 * float(np.linalg.norm(belief.mean[:2])),
        turn_deg=float(np.degrees(belief.mean[2])),
        expected_before_mm=1e3 * found.expected_before_m,
        expected_after_mm=1e3 * found.expected_after_m,
        pose_error_before_mm=nothing[0],
        pose_error_after_mm=after[0],
        turn_error_before_deg=nothing[1],
        turn_error_after_deg=after[1],
        felt_error_before_mm=before_mm,
        felt_error_after_mm=after_mm,
    )


def _pose_error(
    true_pose: FloatArray, seen: FloatArray, transform: FloatArray, pivot: FloatArray
) -> tuple[float, float]:
    """Return how far a transform of what was seen leads from the object: mm at the pivot, and deg."""
    off = np.linalg.inv(transform) @ true_pose @ np.linalg.inv(seen)
    place = off[:3, :3] @ pivot + off[:3, 3] - pivot
    return 1e3 * float(np.linalg.norm(place)), float(
        np.degrees(Rotation.from_matrix(off[:3, :3]).magnitude())
    )


def _near_felt(
    scene: Scene, surface: Surface, execution: ExecutionResult
) -> tuple[float | None, float | None]:
    """Return the surface's distance from the object near felt points, before and after the correction, mm."""
    found = execution.explored
    assert found is not None
    if not len(found.felt):
        return None, None
    pose = found.belief.transform
    places = (found.felt - pose[:3, 3]) @ pose[:3, :3]
    distance, _ = cKDTree(places).query(surface.points)
    near = np.flatnonzero(distance < _NEAR_M)
    seen = scene.transform_object_to_world
    if not len(near):
        return None, None
    errors = [
        1e3
        * float(distances_to_mesh((each.points[near] - seen[:3, 3]) @ seen[:3, :3], scene.model.mesh).mean())
        for each in (surface, found.surface)
    ]
    return errors[0], errors[1]
