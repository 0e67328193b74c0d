"""The radial hand: fingers evenly spaced on a round palm, written as a URDF.

Each finger has an abduction joint, whose axis is radial, and three flexion joints, whose axes are
tangential: bent outwards at the root and inwards further on, the fingers reach around an object below
the palm and touch it from outside.
"""

import math
from dataclasses import dataclass

from graspbench.errors import HandError
from graspbench.hand.parameters import FingerDescription, HandParameters, PalmDescription

JOINTS = ("abduction", "proximal", "middle", "distal")


@dataclass(frozen=True)
class _Body:
    """A solid of uniform density with its centre of mass on the link's z axis."""

    mass_kg: float
    centre_z_m: float
    inertia: tuple[float, float, float]


def describe_radial(parameters: HandParameters) -> tuple[PalmDescription, tuple[FingerDescription, ...]]:
    """Return palm and fingers of the URDF that ``radial_urdf`` returns."""
    fingers = tuple(
        FingerDescription(
            name=f"finger_{i}",
            tip=f"finger_{i}_tip",
            joints=tuple(f"finger_{i}_{joint}" for joint in JOINTS),
            posture_deg=parameters.posture_deg,
            # Bent outwards, out of the way of the others.
            rest_deg=(0.0, parameters.lower_deg[1] + 5.0, parameters.lower_deg[2], parameters.lower_deg[3]),
        )
        for i in range(parameters.fingers)
    )
    return PalmDescription(link="palm"), fingers


def radial_urdf(parameters: HandParameters) -> str:
    """Return the hand as URDF text; root link ``palm``, z axis towards the object.

    Raises:
        HandError: Sizes or limits are inconsistent.
    """
    _check(parameters)
    p = parameters
    parts = ['<?xml version="1.0"?>', f'<robot name="radial_{p.fingers}">', *_materials(), *_palm(p)]
    for i in range(p.fingers):
        parts += _finger(p, i)
    return "\n".join([*parts, "</robot>", ""])


def _check(p: HandParameters) -> None:
    if min(p.link_lengths_m) <= 2 * p.link_radius_m:
        raise HandError(
            f"the radial hand's shortest link ({min(p.link_lengths_m) * 1e3:g} mm) is not longer than a link "
            f"is thick ({2e3 * p.link_radius_m:g} mm)",
            remedy="change hand.link_lengths_m or hand.link_radius_m",
        )
    if p.link_radius_m > p.tip_radius_m:
        raise HandError(
            f"the radial hand's links (radius {p.link_radius_m * 1e3:g} mm) are thicker than its fingertips "
            f"({p.tip_radius_m * 1e3:g} mm)",
            remedy="reduce hand.link_radius_m or enlarge hand.tip_radius_m",
        )
    for joint, low, high, posture in zip(JOINTS, p.lower_deg, p.upper_deg, p.posture_deg, strict=True):
        if not low < posture < high:
            raise HandError(
                f"the radial hand's {joint} joint has limits {low:g} to {high:g} deg and the preferred "
                f"posture {posture:g} deg",
                remedy="keep hand.posture_deg between hand.lower_deg and hand.upper_deg",
            )
    gap = 2 * p.palm_radius_m * math.sin(math.pi / p.fingers) - 2 * p.link_radius_m
    if gap < 0.005:
        raise HandError(
            f"{p.fingers} fingers do not fit on a palm of radius {p.palm_radius_m * 1e3:g} mm",
            remedy="enlarge hand.palm_radius_m or use fewer fingers",
        )


def _materials() -> list[str]:
    colours = {"dark": "0.20 0.22 0.25 1", "light": "0.75 0.77 0.80 1", "tip": "0.90 0.45 0.10 1"}
    return [f'<material name="{name}"><color rgba="{rgba}"/></material>' for name, rgba in colours.items()]


def _palm(p: HandParameters) -> list[str]:
    r, t = p.palm_radius_m, p.palm_thickness_m
    mass = p.density_kg_m3 * math.pi * r * r * t
    lateral = mass * (3 * r * r + t * t) / 12
    body = _Body(mass, -t / 2, (lateral, lateral, mass * r * r / 2))
    shape = (f'<cylinder radius="{_n(r)}" length="{_n(t)}"/>', -t / 2)
    return _link("palm", body, [shape], "dark")


def _finger(p: HandParameters, i: int) -> list[str]:
    name = f"finger_{i}"
    angle = 2 * math.pi * i / p.fingers
    root = (p.palm_radius_m * math.cos(angle), p.palm_radius_m * math.sin(angle), 0.0)
    r = p.link_radius_m
    ball = (f'<sphere radius="{_n(r)}"/>', 0.0)
    out = _link(f"{name}_knuckle", _sphere(p, r), [ball], "dark")
    # Abduction turns about the radial axis x, flexion about y with the sign that curls inwards.
    out += _joint(p, i, 0, "palm", f"{name}_knuckle", root, angle, "1 0 0")
    parent = f"{name}_knuckle"
    offset = 0.0
    for j, length in enumerate(p.link_lengths_m):
        link = f"{name}_{JOINTS[j + 1]}_link"
        rod = (f'<cylinder radius="{_n(r)}" length="{_n(length)}"/>', length / 2)
        out += _link(link, _rod(p, r, length), [ball, rod], "light")
        out += _joint(p, i, j + 1, parent, link, (0.0, 0.0, offset), 0.0, "0 -1 0")
        parent, offset = link, length
    tip = (f'<sphere radius="{_n(p.tip_radius_m)}"/>', 0.0)
    out += _link(f"{name}_tip", _sphere(p, p.tip_radius_m), [tip], "tip")
    out += [
        f'<joint name="{name}_tip_fixed" type="fixed"><parent link="{parent}"/><child link="{name}_tip"/>'
        f'<origin xyz="0 0 {_n(offset)}" rpy="0 0 0"/></joint>'
    ]
    return out


def _sphere(p: HandParameters, radius: float) -> _Body:
    mass = p.density_kg_m3 * 4 / 3 * math.pi * radius**3
    moment = 0.4 * mass * radius * radius
    return _Body(mass, 0.0, (moment, moment, moment))


def _rod(p: HandParameters, radius: float, length: float) -> _Body:
    mass = p.density_kg_m3 * math.pi * radius * radius * length
    lateral = mass * (3 * radius * radius + length * length) / 12
    return _Body(mass, length / 2, (lateral, lateral, mass * radius * radius / 2))


def _link(name: str, body: _Body, shapes: list[tuple[str, float]], material: str) -> list[str]:
    xx, yy, zz = body.inertia
    out = [
        f'<link name="{name}">',
        f'<inertial><origin xyz="0 0 {_n(body.centre_z_m)}" rpy="0 0 0"/><mass value="{_n(body.mass_kg)}"/>'
        f'<inertia ixx="{_n(xx)}" ixy="0" ixz="0" iyy="{_n(yy)}" iyz="0" izz="{_n(zz)}"/></inertial>',
    ]
    for shape, z in shapes:
        geometry = f'<origin xyz="0 0 {_n(z)}" rpy="0 0 0"/><geometry>{shape}</geometry>'
        out.append(f'<visual>{geometry}<material name="{material}"/></visual>')
        out.append(f"<collision>{geometry}</collision>")
    return [*out, "</link>"]


def _joint(
    p: HandParameters,
    finger: int,
    joint: int,
    parent: str,
    child: str,
    xyz: tuple[float, float, float],
    yaw: float,
    axis: str,
) -> list[str]:
    low, high = math.radians(p.lower_deg[joint]), math.radians(p.upper_deg[joint])
    return [
        f'<joint name="finger_{finger}_{JOINTS[joint]}" type="revolute">'
        f'<parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_n(xyz[0])} {_n(xyz[1])} {_n(xyz[2])}" rpy="0 0 {_n(yaw)}"/><axis xyz="{axis}"/>'
        f'<limit lower="{_n(low)}" upper="{_n(high)}" effort="{_n(p.effort_limit_nm)}" '
        f'velocity="{_n(math.radians(p.velocity_limit_deg))}"/>'
        '<dynamics damping="0.01" friction="0"/></joint>'
    ]


def _n(value: float) -> str:
    return f"{value:.12g}"
