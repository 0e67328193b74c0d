"""How far a hand in the simulation differs from the one that the planners know."""

from dataclasses import dataclass

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.model import HandModel
from graspbench.quiet import captured_output
from graspbench.simulation.bullet import pybullet

_POSTURES = 20
_KINDS = {
    pybullet.GEOM_SPHERE: "Sphere",
    pybullet.GEOM_BOX: "Box",
    pybullet.GEOM_MESH: "mesh",
}


@dataclass(frozen=True)
class HandDifference:
    """What differs between a hand's two models.

    Attributes:
        tips_m: Largest distance of a fingertip's centre over random postures.
        links_m: Largest distance of any link's origin that both know.
        mass_share: Difference of the total masses as a share.
        mass_kg: Total mass that the planners know.
        shapes: Numbers of collision shapes, planners' and simulation's.
        sizes_m: Largest difference of a length of spheres and boxes.
    """

    tips_m: float
    links_m: float
    mass_share: float
    mass_kg: float
    shapes: tuple[int, int]
    sizes_m: float


def compare_hand(hand: HandModel, seed: int = 0) -> HandDifference:
    """Load a hand's URDF into PyBullet and compare it with Pinocchio's.

    Args:
        hand: The hand.
        seed: Draws the postures.

    Raises:
        HandError: PyBullet cannot load it.
    """
    client = pybullet.connect(pybullet.DIRECT)
    try:
        with captured_output():
            body = pybullet.loadURDF(
                str(hand.urdf_path),
                useFixedBase=True,
                flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
                physicsClientId=client,
            )
        return _compare(hand, body, client, np.random.default_rng(seed))
    except pybullet.error as error:
        raise HandError(
            f"PyBullet cannot load the hand '{hand.name}' from '{hand.urdf_path}'",
            remedy="save its collision meshes as STL, OBJ or DAE, and check its tree of links",
        ) from error
    finally:
        pybullet.disconnect(client)


def _compare(hand: HandModel, body: int, client: int, generator: np.random.Generator) -> HandDifference:
    infos = [
        pybullet.getJointInfo(body, i, physicsClientId=client)
        for i in range(pybullet.getNumJoints(body, physicsClientId=client))
    ]
    joints = {info[1].decode(): info[0] for info in infos}
    links = {info[12].decode(): info[0] for info in infos}
    tips = links_off = 0.0
    for _ in range(_POSTURES):
        q = generator.uniform(hand.lower, hand.upper)
        at = dict(zip(hand.joint_names, q, strict=True))
        at |= {each.name: each.ratio * at[each.leader] + each.offset for each in hand.followers}
        for name, value in at.items():
            pybullet.resetJointState(body, joints[name], value, physicsClientId=client)
        off = _link_distances(hand, body, client, q, links)
        links_off = max(links_off, max(off.values(), default=0.0))
        tips = max(tips, max((off[tip] for tip in hand.tip_links), default=0.0))
    known = sum(inertia.mass for inertia in hand.model.inertias)
    simulated = sum(
        pybullet.getDynamicsInfo(body, i, physicsClientId=client)[0] for i in (*links.values(), -1)
    ) + _base_mass(hand, body, client)
    return HandDifference(
        tips_m=tips,
        links_m=links_off,
        mass_share=abs(simulated - known) / max(known, 1e-9),
        mass_kg=float(known),
        shapes=(len(hand.geometry.geometryObjects), _shape_count(body, client, links)),
        sizes_m=_size_difference(hand, body, client, links),
    )


def _base_mass(hand: HandModel, body: int, client: int) -> float:
    """Return the mass of a fixed root link, which PyBullet sets to 0 as it cannot move."""
    if pybullet.getDynamicsInfo(body, -1, physicsClientId=client)[0] > 0.0:
        return 0.0
    import xml.etree.ElementTree as ElementTree

    name = pybullet.getBodyInfo(body, physicsClientId=client)[0].decode()
    for link in ElementTree.parse(hand.urdf_path).getroot().findall("link"):
        mass = link.find("inertial/mass")
        if link.get("name") == name and mass is not None:
            return float(mass.get("value", 0.0))
    return 0.0


def _link_distances(
    hand: HandModel, body: int, client: int, q: FloatArray, links: dict[str, int]
) -> dict[str, float]:
    """Return how far the origins of links are apart in the two models, m."""
    data = hand.model.createData()
    pinocchio.framesForwardKinematics(hand.model, data, q)
    found = {}
    for name, i in links.items():
        if hand.model.existBodyName(name):
            state = pybullet.getLinkState(body, i, computeForwardKinematics=True, physicsClientId=client)
            there = data.oMf[hand.model.getFrameId(name, pinocchio.FrameType.BODY)].translation
            found[name] = float(np.linalg.norm(np.array(state[4]) - there))
    return found


def _shapes(body: int, client: int, links: dict[str, int]) -> dict[str, list[tuple[str, FloatArray]]]:
    base = pybullet.getBodyInfo(body, physicsClientId=client)[0].decode()
    found: dict[str, list[tuple[str, FloatArray]]] = {}
    for name, i in [(base, -1), *links.items()]:
        for shape in pybullet.getCollisionShapeData(body, i, physicsClientId=client):
            found.setdefault(name, []).append((_KINDS.get(shape[2], "other"), np.array(shape[3])))
    return found


def _shape_count(body: int, client: int, links: dict[str, int]) -> int:
    return sum(len(shapes) for shapes in _shapes(body, client, links).values())


def _size_difference(hand: HandModel, body: int, client: int, links: dict[str, int]) -> float:
    """Return the largest difference of a length between the spheres and boxes of the two models, m.

    PyBullet does not tell the sizes of cylinders, which it takes for meshes.
    """
    known: dict[str, list[FloatArray]] = {}
    for item in hand.geometry.geometryObjects:
        kind, shape = type(item.geometry).__name__, item.geometry
        if kind == "Sphere":
            known.setdefault(kind, []).append(np.full(3, 2 * shape.radius))
        elif kind == "Box":
            known.setdefault(kind, []).append(2 * np.asarray(shape.halfSide).ravel())
    simulated: dict[str, list[FloatArray]] = {}
    for shapes in _shapes(body, client, links).values():
        for kind, size in shapes:
            if kind == "Sphere":
                simulated.setdefault(kind, []).append(np.full(3, 2 * size[0]))
            elif kind == "Box":
                simulated.setdefault(kind, []).append(size)
    worst = 0.0
    for kind, sizes in known.items():
        others = simulated.get(kind, [])
        if len(others) != len(sizes):
            return float("inf")
        gaps = np.sort(np.array(sizes), axis=0) - np.sort(np.array(others), axis=0)
        worst = max(worst, float(np.abs(gaps).max()))
    return worst
