"""In-hand manipulation: a robot hand moves an object it grasps through a given motion (thesis 4.4)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.grasp.configuration import Grasp
from graspbench.hand import HandModel
from graspbench.manipulation.charts import Chart
from graspbench.manipulation.classification import classify
from graspbench.manipulation.clik import ClikParameters
from graspbench.manipulation.contact_parameters import ContactParameters
from graspbench.manipulation.force_recorder import ForceRecorder
from graspbench.manipulation.held_object import hold_object
from graspbench.manipulation.manipulation_result import ManipulationResult
from graspbench.manipulation.motion import MotionParameters, object_motion
from graspbench.manipulation.motion_result import motion_result
from graspbench.manipulation.reach import follow, refusal
from graspbench.manipulation.sliding.slide import slide
from graspbench.reconstruction.surface import Surface


def manipulate_object(
    hand: HandModel,
    grasp: Grasp,
    surface: Surface | Chart | Sequence[Chart],
    motion: MotionParameters,
    clik: ClikParameters,
    contact: ContactParameters | None = None,
    *,
    transform_object_to_world: FloatArray | None = None,
    gravity: float = 9.81,
) -> ManipulationResult:
    """Move a grasped object through a motion by the fingers alone; the palm stays.

    Args:
        hand: The hand.
        grasp: Grasp with the hand's posture, its contacts in the world.
        surface: The object's reconstructed surface in the world, from which a chart is fitted around
            each contact; or one chart for all contacts, or one a contact, in the object frame.
        motion: What the object shall do, in palm axes.
        clik: Inverse kinematics and secondary tasks.
        contact: Contact type and forces.
        transform_object_to_world: The object's pose; by default its frame is at the grasp's centroid with the
            world's axes.
        gravity: For the contact forces, m/s^2.

    Raises:
        HandError: The grasp has no posture.
        ManipulationError: The grasp cannot follow the motion, or with contacts that slide no forces balance
            the load; the message says how far it can.
    """
    chosen = contact or ContactParameters()
    contacts, way_m = _sliding(hand, grasp, chosen), np.array(chosen.sliding.way_m)
    led = bool(contacts) and bool(np.any(way_m))
    held = hold_object(
        hand,
        grasp,
        surface,
        chosen.kind,
        sliding=contacts,
        led=led,
        patch_radius_m=chosen.patch_radius_m,
        transform_object_to_world=transform_object_to_world,
    )
    palm, trajectory = held.transform_palm_to_world, object_motion(motion, held.position, held.rotation)
    grasp_class = classify(held.system.state(held.joints, held.variables))
    forces = ForceRecorder(chosen, trajectory, palm[:3, :3], clik.step_s, gravity, held.system)
    held = forces.settled(held)
    lead = slide(held, motion, way_m) if led else None
    reach, history = follow(held, motion, clik, lead=lead, watch=forces.watch)
    if history is None:
        raise refusal(reach, way_m if contacts else None)
    moved = motion_result(held, history, grasp_class, forces)
    assert grasp.posture is not None, "hold_object says so"
    return replace(moved, sliding=forces.sliding(grasp.posture.fingers, contacts))


def _sliding(hand: HandModel, grasp: Grasp, contact: ContactParameters) -> tuple[int, ...]:
    """Return the contacts whose fingers are to slide."""
    named = contact.sliding.fingers
    fingers = grasp.posture.fingers if grasp.posture is not None else ()
    absent = [finger for finger in named if finger not in fingers]
    if named and absent:
        raise ManipulationError(
            f"contact.sliding.fingers names finger {absent[0]}, which does not touch the object",
            remedy=f"choose from {', '.join(f'{f} ({hand.finger_names[f]})' for f in fingers)}",
        )
    return tuple(sorted(fingers.index(finger) for finger in named))
