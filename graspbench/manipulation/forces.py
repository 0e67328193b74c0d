"""Contact forces inside the friction cones: force closure, and their distribution along a motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from graspbench.arrays import FloatArray
from graspbench.errors import ManipulationError
from graspbench.grasp.quality import QualityParameters
from graspbench.grasp.sliding_friction import Sliding, sliding_friction
from graspbench.grasp.soft_pad import PadParameters, limit_use
from graspbench.manipulation.contact_kinematics import WITH_TORSION, ContactType, ManipulationSystem, State
from graspbench.manipulation.least_forces import LeastForces
from graspbench.manipulation.limit_surfaces import LimitSurfaces

_MAX_ROUNDS = 60
_SAME_LOAD = 1e-9


@dataclass(frozen=True)
class ForceParameters:
    """How contact forces are distributed."""

    friction: Annotated[float, Field(ge=0, description="Friction coefficient of contacts with friction")] = (
        QualityParameters.friction
    )
    torsion_m: Annotated[
        float, Field(ge=0, description="Largest torque about the normal of a soft finger per unit force, m")
    ] = 0.005
    pad: Annotated[PadParameters, Field(description="Soft pads: their contact patch")] = field(
        default_factory=PadParameters
    )
    cone_edges: Annotated[
        int, Field(ge=3, le=64, description="Edges of the pyramid inside a friction cone")
    ] = 8
    minimum_n: Annotated[float, Field(ge=0, description="Least normal force of a contact, N")] = 0.1
    maximum_n: Annotated[float, Field(gt=0, description="Largest normal force of a contact, N")] = 50.0

    def torque_unit_m(self, kind: ContactType) -> float:
        """Return the unit of a contact's torque in the programme, m; a pad's makes it as large as a force."""
        return self.pad.torsion_m(self.pad.load_n, self.friction) if kind == "soft_pad" else 1.0


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Forces of the fingers on the object that balance a load.

    Attributes:
        forces: Base frame, shape (n_c, 3), N.
        torsions: Torques about the outward normals, shape (n_c,), N m; 0 but for soft fingers and pads.
        normal_forces: Pressing into the object, shape (n_c,), N.
        margins: friction * normal force - tangential force, shape (n_c,), N; for a contact without
            friction its normal force. For a soft pad friction * normal force times the share of its limit
            surface that is left. 0 for a contact that slides.
        smallest_margin: The smallest of those that do not slide.
    """

    forces: FloatArray
    torsions: FloatArray
    normal_forces: FloatArray
    margins: FloatArray
    smallest_margin: float


def contact_wrenches(state: State, frictions: Sequence[float], edges: int = 8) -> FloatArray:
    """Return generators of the contacts' wrench cones about the object's origin, shape (k, rows).

    Args:
        state: The system, evaluated.
        frictions: Friction coefficient of each contact.
        edges: Edges of a friction pyramid; in the plane a cone has two.
    """
    system = state.system
    wrenches = []
    for i, friction in enumerate(frictions):
        normal, tangents, lever = contact_frame(state, i)
        if friction == 0.0:
            directions = [-normal]
        elif system.planar:
            tangent = np.array([-normal[1], normal[0], 0.0])
            directions = [-normal + friction * tangent, -normal - friction * tangent]
        else:
            angles = 2.0 * np.pi * np.arange(edges) / edges
            directions = [
                -normal + friction * (np.cos(a) * tangents[:, 0] + np.sin(a) * tangents[:, 1]) for a in angles
            ]
        wrenches += [np.concatenate([force, np.cross(lever, force)]) for force in directions]
    return np.asarray(wrenches)[:, system.arrays.twist_components]


def contact_frame(state: State, contact: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return outward normal (3,), tangents (3, 2) and lever from the object's origin (3,), base frame."""
    rotation = state.object_rotations[contact]
    normal = rotation @ state.surface_normals[contact]
    first = rotation @ state.surface_tangents[contact][:, 0]
    first = first / np.linalg.norm(first)
    tangents = np.column_stack([first, np.cross(normal, first)])
    return normal, tangents, rotation @ state.surface_points[contact]


def is_force_closure(state: State, frictions: Sequence[float], edges: int = 8) -> bool:
    """Return whether the contacts can balance every wrench: their cones span the whole space positively.

    That is so iff the generators have full rank and a combination with all coefficients positive
    vanishes (Murray, Li and Sastry 1994, proposition 5.3).
    """
    from scipy.optimize import linprog

    wrenches = contact_wrenches(state, frictions, edges)
    k, rows = wrenches.shape
    if np.linalg.matrix_rank(wrenches, tol=1e-9) < rows:
        return False
    found = linprog(np.zeros(k), A_eq=wrenches.T, b_eq=np.zeros(rows), bounds=(1.0, None), method="highs")
    return bool(found.status == 0)


class ForceDistribution:
    """Least squares of the contact forces that balance a load, inside the cones (ProxQP).

    Keeps the solver, so that a motion's many similar problems start warm.

    Args:
        parameters: Friction, bounds and cone edges.
        reserve: Share of its friction that every contact keeps that does not slide.
    """

    def __init__(self, parameters: ForceParameters, reserve: float = 0.0) -> None:
        self.parameters = parameters
        left = 1.0 - reserve
        self._sticking = replace(
            parameters, friction=left * parameters.friction, torsion_m=left * parameters.torsion_m
        )
        self._programme = LeastForces()

    def __call__(
        self, state: State, load: FloatArray, sliding: Mapping[int, Sliding] | None = None
    ) -> ContactForces:
        """Return the smallest forces that balance ``load``.

        Args:
            state: The system, evaluated.
            load: Wrench [f; tau] that the fingers have to apply to the object at its origin, base
                frame, shape (6,), N and N m: inertia less gravity.
            sliding: How chosen contacts slide, velocities in the base frame, shape (3,), of which the part
                along the surface counts. Their friction is on the limit surface against the motion, so that
                only their normal forces are open; all others stick.

        Raises:
            ManipulationError: No forces inside the cones balance the load.
        """
        if not sliding:
            return self._distribute(state, load, {})
        # A pad's patch, and with it how force and torque share its friction, follows the load.
        normals_n = {i: self.parameters.pad.load_n for i in sliding}
        for _ in range(_MAX_ROUNDS):
            drags = {i: self._drag(state, i, slides, normals_n[i]) for i, slides in sliding.items()}
            found = self._distribute(state, load, drags)
            after = {i: float(found.normal_forces[i]) for i in sliding}
            if all(
                state.system.contacts[i].kind != "soft_pad" or abs(after[i] - n) <= _SAME_LOAD * max(n, 1.0)
                for i, n in normals_n.items()
            ):
                return found
            normals_n = after
        raise _unbalanced(load)

    def _drag(self, state: State, contact: int, sliding: Sliding, normal_n: float) -> FloatArray:
        """Return force and torque about the outward normal per newton of a sliding contact, shape (4,)."""
        kind, p = state.system.contacts[contact].kind, self.parameters
        normal, _, _ = contact_frame(state, contact)
        if kind == "frictionless" or p.friction == 0.0:
            return np.array([*-normal, 0.0])
        torsion_m = 0.0
        if not state.system.planar and kind in WITH_TORSION:
            torsion_m = p.torsion_m if kind == "soft" else p.pad.torsion_m(normal_n, p.friction)
        velocity = np.asarray(sliding.velocity, dtype=np.float64)
        along = Sliding(velocity - (velocity @ normal) * normal, sliding.spin_rad_s)
        dragged = sliding_friction(along, 1.0, p.friction, torsion_m)
        return np.array([*(dragged.force - normal), dragged.torque_nm])

    def _distribute(self, state: State, load: FloatArray, drags: Mapping[int, FloatArray]) -> ContactForces:
        system, p = state.system, self._sticking
        frames = [contact_frame(state, i) for i in range(system.n_contacts)]
        columns: list[FloatArray] = []
        spans: list[slice] = []
        count = 0
        for i, (normal, tangents, lever) in enumerate(frames):
            contact = system.contacts[i]
            own = [drags[i][:3]] if i in drags else _directions(contact.kind, normal, tangents, system.planar)
            wrench = [np.concatenate([force, np.cross(lever, force)]) for force in own]
            if i in drags:
                wrench[0][3:] += drags[i][3] * normal
            elif contact.kind in WITH_TORSION and not system.planar:
                wrench.append(np.concatenate([np.zeros(3), p.torque_unit_m(contact.kind) * normal]))
            columns += wrench
            spans.append(slice(count, count + len(wrench)))
            count += len(wrench)
        grasp, wanted = (
            np.array(columns).T[system.arrays.twist_components],
            load[system.arrays.twist_components],
        )
        cones, highs = self._cones(system, spans, count)
        pads = [
            i
            for i, c in enumerate(system.contacts)
            if c.kind == "soft_pad" and not system.planar and i not in drags
        ]
        if not pads:
            x = self._least(grasp, wanted, cones, highs)
            return _collect(state, frames, spans, x, self.parameters, p, drags)
        surfaces = LimitSurfaces([spans[i] for i in pads], count, p.friction, p.pad)
        for _ in range(_MAX_ROUNDS):
            rows = np.vstack([cones, *surfaces.rows()])
            x = self._least(grasp, wanted, rows, np.append(highs, np.zeros(len(rows) - len(highs))))
            if surfaces.contain(x):
                return _collect(state, frames, spans, x, self.parameters, p, drags)
        raise _unbalanced(wanted)

    def _least(self, grasp: FloatArray, load: FloatArray, cones: FloatArray, highs: FloatArray) -> FloatArray:
        found = self._programme(grasp, load, cones, highs)
        if found is None:
            raise _unbalanced(load)
        return found

    def _cones(
        self, system: ManipulationSystem, spans: Sequence[slice], count: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return rows a and bounds b of a . x <= b for all contacts, but for the pads' limit surfaces."""
        rows, highs = [], []
        for contact, span in zip(system.contacts, spans, strict=True):
            for row, high in self._cone(contact.kind, span.stop - span.start, system.planar):
                full = np.zeros(count)
                full[span] = row
                rows.append(full)
                highs.append(high)
        return np.array(rows), np.array(highs)

    def _cone(self, kind: str, size: int, planar: bool) -> list[tuple[FloatArray, float]]:
        """Rows a and bounds b of a . x <= b of one contact; x = (normal, tangential ..., torsion)."""
        p = self._sticking
        unit = np.eye(size)
        rows = [(-unit[0], -p.minimum_n), (unit[0], p.maximum_n)]
        if size == 1 or (kind == "soft_pad" and not planar):
            return rows
        if planar:
            return [*rows, (unit[1] - p.friction * unit[0], 0.0), (-unit[1] - p.friction * unit[0], 0.0)]
        inner = p.friction * np.cos(np.pi / p.cone_edges)
        for angle in 2.0 * np.pi * np.arange(p.cone_edges) / p.cone_edges:
            rows.append((np.cos(angle) * unit[1] + np.sin(angle) * unit[2] - inner * unit[0], 0.0))
        if kind == "soft":
            rows += [(unit[3] - p.torsion_m * unit[0], 0.0), (-unit[3] - p.torsion_m * unit[0], 0.0)]
        return rows


def _unbalanced(load: FloatArray) -> ManipulationError:
    return ManipulationError(
        "no contact forces inside the friction cones balance the load",
        remedy="raise the friction or the largest force, or move the object more slowly",
        load=load,
    )


def _directions(kind: str, normal: FloatArray, tangents: FloatArray, planar: bool) -> list[FloatArray]:
    if kind == "frictionless":
        return [-normal]
    if planar:
        return [-normal, np.array([-normal[1], normal[0], 0.0])]
    return [-normal, tangents[:, 0], tangents[:, 1]]


def _collect(
    state: State,
    frames: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
    spans: Sequence[slice],
    x: FloatArray,
    p: ForceParameters,
    sticking: ForceParameters,
    drags: Mapping[int, FloatArray],
) -> ContactForces:
    n, planar = state.system.n_contacts, state.system.planar
    forces, torsions, normals, margins = np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(n)
    for i, (contact, (normal, tangents, _), span) in enumerate(
        zip(state.system.contacts, frames, spans, strict=True)
    ):
        own = x[span]
        if i in drags:
            forces[i], torsions[i], normals[i] = own[0] * drags[i][:3], own[0] * drags[i][3], own[0]
            continue
        directions = _directions(contact.kind, normal, tangents, planar)
        forces[i] = np.sum([f * direction for f, direction in zip(own, directions, strict=False)], axis=0)
        if contact.kind in WITH_TORSION and not planar:
            torsions[i] = sticking.torque_unit_m(contact.kind) * own[3]
        normals[i] = own[0]
        friction = 0.0 if contact.kind == "frictionless" else p.friction
        sideways = float(np.linalg.norm(forces[i] + own[0] * normal))
        if contact.kind == "soft_pad" and not planar:
            torsion_m = p.pad.torsion_m(own[0], friction)
            sideways = friction * own[0] * limit_use(sideways, torsions[i], own[0], friction, torsion_m)
        margins[i] = own[0] if friction == 0.0 else friction * own[0] - sideways
    others = [i for i in range(n) if i not in drags]
    smallest = float(margins[others].min()) if others else 0.0
    return ContactForces(forces, torsions, normals, margins, smallest)
