"""From a published file to a hand's description, every part of it found or given."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.completion import completed_description, parsed_urdf
from graspbench.hand.files import find_urdf, write_urdf
from graspbench.hand.importing.opposition import Opposition, find_opposition
from graspbench.hand.importing.structure import FoundFinger, Structure, find_structure
from graspbench.hand.importing.tips import FoundTip, LastLink, closing_sides, fit_tip, last_link
from graspbench.hand.importing.trying import is_better_with_two
from graspbench.hand.loading import load_hand, read_urdf
from graspbench.hand.model import HandModel
from graspbench.hand.parameters import FingerDescription, HandParameters, PalmDescription, TipShape, Vector3

OBJECT_M = 0.06
_CHOICE = 2
"""Directions in which wrist and fingers can still move when all tips are placed, for a hand to be useful."""


@dataclass(frozen=True)
class Guesses:
    """What the user knows better than the import.

    Attributes:
        palm: The palm's link.
        approach: Direction from palm to object in the palm's link, shape (3,).
        fingers: How many fingers to use.
        drop: Fingers to leave out.
        tips: Link and centre of the tip, m, by finger.
        tip_radius_m: Radius of the tips.
        tip_shape: What touches: spheres, or the last links as they are.
        postures_deg: Posture of a grasp by finger, deg or mm.
        rests_deg: Posture out of the way by finger, deg or mm.
        locked_deg: Joints that are held, deg or mm.
        object_m: Width of the object that the posture is for.
        package_dirs: Folders to look for ``package://`` files in.
    """

    palm: str | None = None
    approach: tuple[float, float, float] | None = None
    fingers: int | None = None
    drop: tuple[str, ...] = ()
    tips: Mapping[str, tuple[str, tuple[float, float, float]]] = field(default_factory=dict)
    tip_radius_m: float | None = None
    tip_shape: TipShape = "sphere"
    postures_deg: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    rests_deg: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    locked_deg: Mapping[str, float] = field(default_factory=dict)
    object_m: float = OBJECT_M
    package_dirs: tuple[str, ...] = ()


@dataclass(frozen=True)
class ImportedHand:
    """A hand as it was read.

    Attributes:
        parameters: Its description.
        structure: Its tree.
        tips: The fingertips by finger.
        opposition: How the fingers oppose.
        hand: The loaded hand.
    """

    parameters: HandParameters
    structure: Structure
    tips: Mapping[str, FoundTip]
    opposition: Opposition
    hand: HandModel


def import_hand(path: Path, name: str, guesses: Guesses) -> ImportedHand:
    """Read a hand from a URDF and find palm, fingers, tips, closing direction and an opposing posture.

    Args:
        path: The URDF.
        name: What to call the hand.
        guesses: What is known.

    Raises:
        HandError: The file cannot be read, or has no two fingers.
    """
    source, folders = find_urdf(str(path), guesses.package_dirs, name)
    structure = find_structure(parsed_urdf(source, name), name, guesses.palm, guesses.drop)
    held = {joint: guesses.locked_deg.get(joint, 0.0) for joint in structure.shared}
    parameters = HandParameters(
        name=name,
        kind="urdf",
        urdf=str(source),
        package_dirs=guesses.package_dirs,
        palm=PalmDescription(structure.palm),
        locked_deg=held | dict(guesses.locked_deg),
    )
    robot, _ = completed_description(source, folders, parameters)
    model, geometry = read_urdf(write_urdf(_text(robot), source.stem), folders, name)
    _refuse_unknown(structure, guesses, name)
    fingers = tuple(finger for finger in structure.fingers if model.existJointName(finger.joints[-1]))
    if len(fingers) < 2:
        raise HandError(
            f"hand '{name}' has {len(fingers)} finger(s) that are not locked",
            remedy="lock fewer joints (--lock)",
        )
    lasts, tips = _find_tips(model, geometry, fingers, structure, guesses)
    radius = guesses.tip_radius_m or float(np.median([tip.radius_m for tip in tips.values()]))
    chains = tuple(_described(model, finger, tips[finger.name], guesses) for finger in fingers)
    bare = replace(parameters, chains=chains, tip_radius_m=round(radius, 5), fingers=len(chains))
    hand = load_hand(bare)
    approach = (
        None if guesses.approach is None else np.array(guesses.approach) / np.linalg.norm(guesses.approach)
    )
    opposition = find_opposition(hand, [last.pad for last in lasts], 0.5 * guesses.object_m, approach)
    parameters = _with_opposition(bare, hand, opposition, guesses)
    found = load_hand(parameters)
    if guesses.fingers is None and parameters.fingers == 3:
        two = replace(parameters, fingers=2)
        if is_better_with_two(found, load_hand(two), guesses.object_m):
            parameters, found = two, load_hand(two)
    if guesses.tip_shape != parameters.tip_shape:
        parameters = replace(parameters, tip_shape=guesses.tip_shape)
        found = load_hand(parameters)
    return ImportedHand(parameters, structure, tips, opposition, found)


def _find_tips(
    model: pinocchio.Model,
    geometry: pinocchio.GeometryModel,
    fingers: tuple[FoundFinger, ...],
    structure: Structure,
    guesses: Guesses,
) -> tuple[list[LastLink], dict[str, FoundTip]]:
    palm = model.frames[model.getFrameId(structure.palm)].placement
    lasts = [last_link(model, geometry, finger, palm) for finger in fingers]
    ends = [
        last.points[int(np.argmax(last.points @ last.outwards))] if len(last.points) else 0.03 * last.outwards
        for last in lasts
    ]
    sides = closing_sides(model, lasts, ends)
    lasts = [replace(last, pad=side) for last, side in zip(lasts, sides, strict=True)]
    given = guesses.tip_radius_m
    tips = {}
    for finger, last in zip(fingers, lasts, strict=True):
        if finger.name in guesses.tips:
            link, xyz = guesses.tips[finger.name]
            if not model.existFrame(link):
                known = ", ".join(f.name for f in model.frames if f.type == pinocchio.FrameType.BODY)
                raise HandError(f"hand '{model.name}' has no link '{link}'", remedy=f"choose one of {known}")
            centre = model.frames[model.getFrameId(link)].placement.act(np.array(xyz))
            tips[finger.name] = FoundTip(
                centre, given or fit_tip(model, finger, last, None).radius_m, "given"
            )
        else:
            tips[finger.name] = fit_tip(model, finger, last, given)
    # One radius for all: spheres of links that differ in width are fitted again with the middle one.
    radii = [tip.radius_m for tip in tips.values()]
    if given is None and np.ptp(radii) > 1e-9:
        middle = round(float(np.median(radii)), 5)
        for finger, last in zip(fingers, lasts, strict=True):
            if finger.name not in guesses.tips and abs(tips[finger.name].radius_m - middle) > 1e-9:
                tips[finger.name] = fit_tip(model, finger, last, middle)
    return lasts, tips


def _described(
    model: pinocchio.Model, finger: FoundFinger, tip: FoundTip, guesses: Guesses
) -> FingerDescription:
    link, frame = finger.link, model.frames[model.getFrameId(finger.link)]
    if finger.name in guesses.tips:
        link = guesses.tips[finger.name][0]
        frame = model.frames[model.getFrameId(link)]
    centre = frame.placement.actInv(tip.centre)
    return FingerDescription(name=finger.name, tip=link, tip_xyz_m=_rounded(centre, 6))


def _with_opposition(
    bare: HandParameters, hand: HandModel, found: Opposition, guesses: Guesses
) -> HandParameters:
    chains = []
    for f, finger in enumerate(bare.chains):
        posture = guesses.postures_deg.get(finger.name) or _own_degrees(hand, f, found.joints)
        rest = guesses.rests_deg.get(finger.name) or _own_degrees(hand, f, found.rest)
        chains.append(replace(finger, posture_deg=posture, rest_deg=rest))
    names = [finger.name for finger in bare.chains]
    subsets = {
        size: tuple(names[f] for f in chosen) for size, chosen in found.subsets.items() if size < len(names)
    }
    whole = found.subsets[len(names)]
    count = guesses.fingers or _fingers_to_use(hand, found)
    palm = found.transform_palm_to_link
    rpy = np.degrees(pinocchio.rpy.matrixToRpy(palm[:3, :3]))
    return replace(
        bare,
        fingers=count,
        chains=tuple(chains[f] for f in whole),
        subsets={size: chosen for size, chosen in subsets.items() if 2 <= size <= 5},
        palm=PalmDescription(
            bare.palm.link,
            _rounded(palm[:3, 3], 5),
            _rounded(rpy, 3),
        ),
    )


def _rounded(values: FloatArray, digits: int) -> Vector3:
    x, y, z = (float(round(value, digits)) + 0.0 for value in values)
    return x, y, z


def _own_degrees(hand: HandModel, finger: int, joints: FloatArray) -> tuple[float, ...]:
    """Return a finger's joints, those that follow left out, in deg or mm, well inside their limits."""
    values = []
    for k in hand.led_joints(finger):
        i = hand.chains.index[finger, k]
        scale = 1e3 if hand.slides(finger, k) else 180.0 / np.pi
        room = 0.02 * (hand.upper[i] - hand.lower[i])
        inside = float(np.clip(joints[i], hand.lower[i] + room, hand.upper[i] - room))
        values.append(round(scale * inside, 3))
    return tuple(values)


def _fingers_to_use(hand: HandModel, found: Opposition) -> int:
    """Return 3, or 2 where three fingers' joints with the wrist's six leave little choice of where it is."""
    if hand.n_fingers < 3:
        return 2
    own = {int(i) for f in found.subsets[3] for i in hand.finger_joints(f)}
    return 3 if len(own) + 6 >= 9 + _CHOICE else 2


def _refuse_unknown(structure: Structure, guesses: Guesses, hand: str) -> None:
    names = [finger.name for finger in structure.fingers]
    for given in (*guesses.tips, *guesses.postures_deg, *guesses.rests_deg):
        if given not in names:
            raise HandError(
                f"hand '{hand}' has no finger '{given}'", remedy=f"its fingers are {', '.join(names)}"
            )


def _text(robot: ElementTree.Element) -> str:
    return ElementTree.tostring(robot, encoding="unicode")
