"""Force closure: can the contacts resist any wrench?"""

import numpy as np

from graspbench.arrays import BoolArray, FloatArray
from graspbench.grasp.contact import ContactModel, contact_polytope
from graspbench.grasp.epsilon import CLOSURE_TOLERANCE, smallest_support
from graspbench.grasp.quality import QualityParameters, unit_batch
from graspbench.grasp.wrench import WrenchSpace, wrench_maps

__all__ = ["CLOSURE_TOLERANCE", "force_closure", "is_force_closure"]


def is_force_closure(
    points: FloatArray,
    normals_in: FloatArray,
    centre: FloatArray,
    *,
    contact: ContactModel = "hard_finger",
    wrench_space: WrenchSpace = "spatial",
    friction: float = 0.5,
    cone_edges: int = 8,
    torque_length: float = 1.0,
    tangents: FloatArray | None = None,
    torsional_friction: float = 0.05,
) -> bool | BoolArray:
    """Tell whether grasps are force closure: the origin is inside the hull of the unit cone wrenches.

    Exact for the linearised cones (Murray, Li and Sastry 1994, proposition 5.3). The arguments are those
    of `graspbench.grasp.grasp_quality`.

    Returns:
        A bool for one grasp, shape (n,) for a batch.
    """
    points, normals_in = unit_batch(points, normals_in)
    maps = wrench_maps(
        points,
        normals_in,
        np.asarray(centre, dtype=np.float64),
        contact=contact,
        wrench_space=wrench_space,
        torque_length=torque_length,
        tangents=tangents,
    )
    polytope = contact_polytope(contact, friction, cone_edges, torsional_friction)
    wrenches = polytope.vertices @ np.swapaxes(maps, -1, -2)
    stacked = wrenches.reshape(-1, *wrenches.shape[-3:])
    closed = smallest_support(stacked, polytope, stop_at=CLOSURE_TOLERANCE) > CLOSURE_TOLERANCE
    return closed if points.ndim == 3 else bool(closed[0])


def force_closure(
    points: FloatArray,
    normals_in: FloatArray,
    centre: FloatArray,
    quality: QualityParameters,
    torque_length_m: float,
) -> bool | BoolArray:
    """Tell whether grasps are force closure in the model of the quality parameters."""
    return is_force_closure(
        points,
        normals_in,
        centre,
        contact=quality.contact,
        wrench_space=quality.wrench_space,
        friction=quality.friction,
        cone_edges=quality.cone_edges,
        torque_length=torque_length_m,
        torsional_friction=quality.torsion(torque_length_m),
    )
