"""How sliding contacts are led over the object, and how their tips slide in it."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.grasp.sliding_friction import Sliding
from graspbench.manipulation.clik import Clik
from graspbench.manipulation.contact_kinematics import State
from graspbench.manipulation.held_object import HeldObject
from graspbench.manipulation.motion import MotionParameters, motion_share

_GAIN = 20.0
_MIN_SLIP_M_S = 1e-6
"""A contact that slides more slowly rests."""
_MIN_ALONG = 0.1


@dataclass(frozen=True, eq=False)
class Slide:
    """Leads contacts along straight lines of their charts, from the motion's start to its end.

    Attributes:
        starts: Coordinates of all contacts at the start, shape (n_c, 2).
        ways: How far these go, 0 for contacts that are not led, shape (n_c, 2).
        motion: In step with which.
    """

    starts: FloatArray
    ways: FloatArray
    motion: MotionParameters

    def __call__(self, time_s: float, contacts: FloatArray) -> FloatArray:
        """Return the coordinates' rates, shape (n_c, 2), which also make up for what is missing."""
        share, rate = motion_share(self.motion, time_s)
        missing = self.starts + share * self.ways - contacts[:, :2]
        led: FloatArray = rate * self.ways + _GAIN * missing
        led[~np.any(self.ways, axis=1)] = 0.0
        return led


def slide(held: HeldObject, motion: MotionParameters, way_m: FloatArray) -> Slide:
    """Return what leads the contacts of a system that are led.

    Args:
        held: Where it starts.
        motion: The object's motion; the way is as long, and there and back if that is.
        way_m: In the palm frame, shape (3,).

    Raises:
        ManipulationError: The way goes into the object at a contact.
    """
    starts = held.variables[:, :2].copy()
    ways = np.zeros_like(starts)
    local = held.rotation.T @ way_m
    for i, contact in enumerate(held.system.contacts):
        if not contact.led:
            continue
        at = contact.chart(starts[i])
        ways[i] = np.linalg.lstsq(at.tangents, local, rcond=None)[0]
        if np.linalg.norm(at.tangents @ ways[i]) < _MIN_ALONG * np.linalg.norm(local):
            normal = ", ".join(f"{v:.2f}" for v in held.rotation @ at.frame[:, 2])
            raise ManipulationError(
                f"contact.sliding.way_m does not run along the object's surface at contact {i}",
                remedy=f"choose a way across the surface's normal there, [{normal}]",
            )
    return Slide(starts, ways, motion)


def slips(clik: Clik) -> tuple[FloatArray, FloatArray]:
    """Return how the tips slide over the object: palm frame, shape (n_c, 3), and about the normals, (n_c,).

    What counts is the tip's material point at the contact against the object's.

    Args:
        clik: The law, its state and velocity up to date.
    """
    state, velocity = clik.state, clik.last_velocity
    system = state.system
    along, spins = np.empty((system.n_contacts, 3)), np.empty(system.n_contacts)
    carried = (state.jacobian @ velocity).reshape(system.n_contacts, 6)
    for i, contact in enumerate(system.contacts):
        rotation, normal, spin = state.object_rotations[i], state.surface_normals[i], state.surface_spins[i]
        riding = state.surface_tangents[i] + contact.tip_radius_m * np.cross(spin.T, normal).T
        # of the tip against the object: at the tip's centre, and about it
        relative = state.tip_jacobians[i] @ velocity[: system.n_joints] - carried[i]
        relative += np.concatenate([rotation @ riding, rotation @ spin]) @ clik.led_rates[i]
        normal = rotation @ normal
        slip = relative[:3] - contact.tip_radius_m * np.cross(relative[3:], normal)
        along[i], spins[i] = slip - (slip @ normal) * normal, relative[3:] @ normal
    return along, spins


def sliding_contacts(state: State, along: FloatArray, spins: FloatArray) -> dict[int, Sliding]:
    """Return the contacts that shall slide and do: not those at rest, which stick."""
    return {
        i: Sliding(along[i], float(spins[i]))
        for i, contact in enumerate(state.system.contacts)
        if contact.slides and np.linalg.norm(along[i]) > _MIN_SLIP_M_S
    }
