"""Masses and inertias of links that state none, from their collision shapes."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.errors import HandError

# Of a link without a shape, a bare frame: light against any finger, and no zero, which Bullet takes as fixed.
_BARE_KG, _BARE_KGM2 = 1e-3, 1e-7


@dataclass(frozen=True)
class _Solid:
    """A solid of density 1 in its link's frame: volume, centroid (3,), inertia about it (3, 3)."""

    volume: float
    centre: FloatArray
    inertia: FloatArray


def complete_inertias(robot: ElementTree.Element, density_kg_m3: float, hand: str) -> None:
    """Give every link a mass and an inertia, in place.

    A link without ``<inertial>``, or with a mass of 0, is as heavy as its collision shapes (meshes: their
    convex hulls) of this density; the shapes' overlaps count twice. A link without shapes weighs a gram. One
    that states a mass but no inertia takes that of its shapes.

    Args:
        robot: The URDF; its meshes are named by their full paths.
        density_kg_m3: The density.
        hand: Name of the hand, for error messages.

    Raises:
        HandError: A collision mesh cannot be read, or a number is none.
    """
    for link in robot.iter("link"):
        inertial = link.find("inertial")
        mass = _mass(inertial, link, hand)
        if inertial is not None and mass > 0.0 and _has_inertia(inertial):
            continue
        solids = [solid for shape in link.findall("collision") for solid in _solids(shape, hand)]
        volume = sum(solid.volume for solid in solids)
        if volume > 0.0:
            centre = np.asarray(sum(solid.volume * solid.centre for solid in solids)) / volume
            about = np.asarray(sum(_about(solid, centre) for solid in solids)) / volume
            mass = mass if mass > 0.0 else density_kg_m3 * volume
        else:
            centre, about = np.zeros(3), (_BARE_KGM2 / _BARE_KG) * np.eye(3)
            mass = mass if mass > 0.0 else _BARE_KG
        if inertial is not None:
            link.remove(inertial)
        link.append(_element(mass, centre, mass * about))


def _mass(inertial: ElementTree.Element | None, link: ElementTree.Element, hand: str) -> float:
    element = None if inertial is None else inertial.find("mass")
    text = "0" if element is None else element.get("value", "0")
    try:
        return max(float(text), 0.0)
    except ValueError:
        raise HandError(
            f"link '{link.get('name')}' of hand '{hand}' has the mass '{text}'", remedy="give a number in kg"
        ) from None


def _has_inertia(inertial: ElementTree.Element) -> bool:
    element = inertial.find("inertia")
    return element is not None and all(float(element.get(name, 0.0)) > 0.0 for name in ("ixx", "iyy", "izz"))


def _solids(collision: ElementTree.Element, hand: str) -> list[_Solid]:
    origin, geometry = collision.find("origin"), collision.find("geometry")
    rotation, centre = np.eye(3), np.zeros(3)
    if origin is not None:
        centre = np.array([float(v) for v in origin.get("xyz", "0 0 0").split()])
        rotation = pinocchio.rpy.rpyToMatrix(np.array([float(v) for v in origin.get("rpy", "0 0 0").split()]))
    found = []
    for shape in geometry if geometry is not None else ():
        own = _own(shape, hand)
        found.append(_Solid(own.volume, centre + rotation @ own.centre, rotation @ own.inertia @ rotation.T))
    return found


def _own(shape: ElementTree.Element, hand: str) -> _Solid:
    """Return the solid of a URDF's geometry in its own frame."""
    if shape.tag == "box":
        x, y, z = (float(v) for v in shape.get("size", "0 0 0").split())
        volume = x * y * z
        moments = volume / 12.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
        return _Solid(volume, np.zeros(3), np.diag(moments))
    if shape.tag == "sphere":
        r = float(shape.get("radius", 0.0))
        volume = 4.0 / 3.0 * np.pi * r**3
        return _Solid(volume, np.zeros(3), 0.4 * volume * r * r * np.eye(3))
    if shape.tag in ("cylinder", "capsule"):
        r, length = float(shape.get("radius", 0.0)), float(shape.get("length", 0.0))
        volume = np.pi * r * r * length
        lateral = volume * (3.0 * r * r + length * length) / 12.0
        return _Solid(volume, np.zeros(3), np.diag([lateral, lateral, 0.5 * volume * r * r]))
    import trimesh  # here: it takes long to load, and most hands state their masses

    file = shape.get("filename", "")
    try:
        hull = trimesh.load_mesh(file).convex_hull
    except Exception as error:  # trimesh raises whatever its readers raise
        raise HandError(
            f"the collision mesh '{file}' of hand '{hand}' cannot be read ({type(error).__name__})",
            remedy="save it as STL, OBJ or DAE",
            mesh=file,
        ) from error
    hull.apply_scale([float(v) for v in shape.get("scale", "1 1 1").split()])
    return _Solid(float(hull.volume), np.asarray(hull.center_mass), np.asarray(hull.moment_inertia))


def _about(solid: _Solid, point: FloatArray) -> FloatArray:
    """Return a solid's inertia about a point (Huygens-Steiner)."""
    arm = solid.centre - point
    return solid.inertia + solid.volume * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def _element(mass: float, centre: FloatArray, inertia: FloatArray) -> ElementTree.Element:
    inertial = ElementTree.Element("inertial")
    ElementTree.SubElement(inertial, "origin", xyz=" ".join(f"{v:.12g}" for v in centre), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=f"{mass:.12g}")
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
    values = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
    ElementTree.SubElement(inertial, "inertia", {name: f"{v:.12g}" for name, v in values.items()})
    return inertial
