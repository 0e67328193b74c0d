"""What may be wrong with a hand, one sentence each with what to do about it."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from graspbench.config.trial_config import load_config
from graspbench.errors import GraspbenchError
from graspbench.hand import GraspChecker, HandModel, HandParameters, load_hand
from graspbench.hand.completion import is_only_seen, touch_what_is_seen
from graspbench.hand.files import find_urdf
from graspbench.hand.importing.ranges import WIDE_DEG
from graspbench.hand.verification import overlaps
from graspbench.simulation.hand_comparison import compare_hand

Verdict = Literal["ok", "note", "fault"]
_POSTURES = 500
_REFERENCES = ("sphere", "cylinder")
TWO_FINGERS = "quality.contact=soft_finger"
"""Two points with friction hold no object: it turns about the line between them."""

_TIP_M, _MASS_SHARE, _LENGTH_M = 1e-4, 0.01, 1e-6


@dataclass(frozen=True)
class Finding:
    """One line of a check.

    Attributes:
        aspect: What was looked at.
        verdict: ok; note: something was assumed or limits what the hand can do; fault: it will not work.
        sentence: What is so, and what to do where something is wrong.
    """

    aspect: str
    verdict: Verdict
    sentence: str


def check_hand(
    name: str, overrides: Sequence[str] = (), config_dir: Path | None = None, *, hold: bool = True
) -> Iterator[Finding]:
    """Check a hand: its file, its kinematics, its simulation, and whether it holds two reference objects.

    Args:
        name: An option of the configuration group ``hand``.
        overrides: Options such as ``hand.fingers=4``.
        config_dir: A folder with further configuration groups and options.
        hold: Try to hold the reference objects too.

    Raises:
        HandError: The hand cannot be loaded.
    """
    chosen = [f"hand={name}", "record=off", *overrides]
    parameters = load_config(chosen, config_dir).hand
    hand = load_hand(parameters)
    if parameters.kind == "urdf":
        yield from _file_findings(parameters)
    yield _touch_finding(hand)
    yield from _workspace_findings(hand)
    yield from _opposition_findings(hand)
    yield from _simulation_findings(hand)
    if hold:
        for item in _REFERENCES:
            yield _hold_finding(chosen, item, config_dir)


def _file_findings(parameters: HandParameters) -> Iterator[Finding]:
    source, _ = find_urdf(parameters.urdf, parameters.package_dirs, parameters.name)
    robot = ElementTree.parse(source).getroot()
    links = robot.findall("link")
    if is_only_seen(robot):
        yield Finding(
            "shapes",
            "note",
            "no link has a collision shape: the shapes that are seen stand for them; give <collision> shapes "
            "in the file, or hand.collision.",
        )
        touch_what_is_seen(robot)
    bare = [link.get("name", "") for link in links if _massless(link) and link.find("collision") is not None]
    if bare:
        yield Finding(
            "inertia",
            "note",
            f"{len(bare)} of {len(links)} links state no mass ({_few(bare)}): they weigh as their shapes at "
            f"{parameters.density_kg_m3:g} kg/m^3; give <inertial> in the file, or set hand.density_kg_m3.",
        )
    else:
        yield Finding("inertia", "ok", "all links with shapes state their mass.")
    joints = [j for j in robot.findall("joint") if j.get("type") in ("revolute", "prismatic")]
    for limit, unit, option in (
        ("effort", f"{parameters.effort_limit_nm:g} N m", "hand.effort_limit_nm"),
        ("velocity", f"{parameters.velocity_limit_deg:g} deg/s", "hand.velocity_limit_deg"),
    ):
        missing = [j.get("name", "") for j in joints if not _positive(j.find("limit"), limit)]
        if missing:
            yield Finding(
                limit,
                "note",
                f"{len(missing)} of {len(joints)} joints give no {limit} limit ({_few(missing)}): {unit} is "
                f"taken; correct it in the file or set {option}.",
            )
        else:
            yield Finding(limit, "ok", f"all {len(joints)} joints give a {limit} limit.")
    wide = [joint.get("name", "") for joint in joints if _turn_deg(joint) >= WIDE_DEG]
    if wide:
        yield Finding(
            "range",
            "note",
            f"{len(wide)} of {len(joints)} joints turn by {WIDE_DEG:.0f} deg or more ({_few(wide)}): where "
            "these limits are not the real ones, correct them in the file and read it again, as the posture "
            "of a grasp is found within them, or give it with --posture.",
        )
    meshes = [mesh for link in links for mesh in link.findall("collision/geometry/mesh")]
    yield Finding("meshes", "ok", f"all {len(meshes)} collision meshes were found and read.")


def _touch_finding(hand: HandModel) -> Finding:
    """Say which shape touches, and where the links reach farther than it."""
    size = f"{1e3 * hand.pad_radius_m:.1f} mm"
    if hand.tips_are_links:
        ends = {joints[-1] for joints in hand.chain_joints}
        own = [item.geometry for item in hand.geometry.geometryObjects if item.parentJoint in ends]
        return Finding(
            "touching",
            "ok",
            f"the fingers touch with their last links as they are ({_few(_shape_names(own))}), within "
            f"{2e3 * hand.pad_radius_m:.0f} mm of their ends.",
        )
    if hand.bare_tips:
        return Finding(
            "touching",
            "note",
            f"the fingers touch with spheres of {size}, which the description lacks at "
            f"{_few(hand.bare_tips)}: the links touch as they really are with hand.tip_shape=link.",
        )
    return Finding("touching", "ok", f"the fingers touch with spheres of {size} that the description has.")


def _shape_names(shapes: Sequence[object]) -> list[str]:
    names = ["mesh" if hasattr(shape, "vertices") else type(shape).__name__.lower() for shape in shapes]
    return [f"{names.count(name)} x {name}" for name in dict.fromkeys(names)]


def _turn_deg(joint: ElementTree.Element) -> float:
    """Return by how much a joint turns between its limits; 0 for one that slides."""
    limit = joint.find("limit")
    if limit is None or joint.get("type") != "revolute":
        return 0.0
    return float(np.degrees(float(limit.get("upper", "0")) - float(limit.get("lower", "0"))))


def _workspace_findings(hand: HandModel) -> Iterator[Finding]:
    generator = np.random.default_rng(0)
    drawn = generator.uniform(hand.lower, hand.upper, (_POSTURES, hand.n_joints))
    tips = np.array([hand.tip_positions(joints) for joints in drawn])
    jacobians = np.array([hand.tip_jacobians(joints) for joints in drawn])
    values = np.linalg.svd(jacobians, compute_uv=False)
    for f, name in enumerate(hand.finger_names):
        size = " x ".join(f"{1e3 * length:.0f}" for length in np.ptp(tips[:, f], axis=0))
        yield Finding("workspace", "ok", f"the tip of finger '{name}' reaches a box of {size} mm.")
        smallest = values[:, f, hand.freedom[f] - 1]
        typical = float(np.median(smallest))
        said = f"finger '{name}' moves its tip in {hand.freedom[f]} directions"
        if hand.freedom[f] < 3:
            said += ", and the wrist makes up for the others"
        if typical < hand.margins.singular_value_m:
            yield Finding(
                "singular values",
                "fault",
                f"{said}, but its smallest singular value is {1e3 * typical:.1f} mm/rad in the middle of its "
                f"range, below the margin of {1e3 * hand.margins.singular_value_m:.1f}: lower "
                "hand.margins.singular_value_m, or lock a joint that does not move the tip.",
            )
        else:
            verdict: Verdict = "ok" if hand.freedom[f] == 3 else "note"
            yield Finding(
                "singular values",
                verdict,
                f"{said}; smallest singular value {1e3 * typical:.1f} mm/rad typically.",
            )


def _opposition_findings(hand: HandModel) -> Iterator[Finding]:
    tips = hand.tip_positions(hand.preferred)
    centre = tips.mean(axis=0)
    away = tips - centre
    gaps = np.linalg.norm(away, axis=1)
    imbalance = float(np.linalg.norm((away / np.maximum(gaps, 1e-9)[:, None]).mean(axis=0)))
    around = 2e3 * (float(gaps.mean()) - hand.tip_radius_m)
    said = f"in the preferred posture the fingers close around {around:.0f} mm"
    if imbalance > 0.5 or around <= 0.0:
        yield Finding(
            "opposition",
            "fault",
            f"{said} but do not oppose each other (imbalance {imbalance:.2f}): change posture_deg of the "
            "fingers (hand.chains), or add the hand again with 'hands add'.",
        )
    else:
        yield Finding("opposition", "ok", f"{said} and oppose each other (imbalance {imbalance:.2f} of 1).")
    if centre[2] <= 0.0:
        yield Finding(
            "palm frame",
            "fault",
            f"the fingertips are {-1e3 * centre[2]:.0f} mm behind the palm frame, whose z axis has to point "
            "to the object: correct hand.palm.",
        )
    else:
        yield Finding("palm frame", "ok", f"the fingertips close {1e3 * centre[2]:.0f} mm before the palm.")
    for posture, joints in (("preferred posture", hand.preferred), ("posture at rest", hand.rest)):
        if found := overlaps(hand, joints):
            yield Finding(
                "collisions",
                "fault" if joints is hand.preferred else "note",
                f"in the {posture} {found[0]}"
                + (f", and {len(found) - 1} more" if len(found) > 1 else "")
                + ": change posture_deg or rest_deg, or replace shapes by hand.collision.",
            )
        else:
            yield Finding("collisions", "ok", f"nothing overlaps in the {posture}.")
    span = GraspChecker(hand).pair_limit_m
    yield Finding(
        "span",
        "ok",
        f"two fingertips touch objects of at most {1e3 * span:.0f} mm.",
    )


def _simulation_findings(hand: HandModel) -> Iterator[Finding]:
    found = compare_hand(hand)
    good = found.tips_m <= _TIP_M and found.links_m <= _TIP_M
    yield Finding(
        "simulated positions",
        "ok" if good else "fault",
        f"simulated and planned fingertips differ by {1e3 * found.tips_m:.4f} mm at most"
        + (
            "."
            if good
            else f", links by {1e3 * found.links_m:.3f}: give every joint an axis of length 1 and one parent."
        ),
    )
    same = found.shapes[0] == found.shapes[1] and found.sizes_m <= _LENGTH_M
    yield Finding(
        "simulated shapes",
        "ok" if same else "fault",
        f"both models have {found.shapes[0]} collision shapes"
        + (
            " of the same sizes."
            if same
            else f"; the simulation has {found.shapes[1]}, lengths differ by {1e3 * found.sizes_m:.3g} mm: "
            "replace the shapes by hand.collision."
        ),
    )
    heavy = found.mass_share > _MASS_SHARE
    yield Finding(
        "simulated masses",
        "fault" if heavy else "ok",
        f"the hand weighs {1e3 * found.mass_kg:.0f} g, "
        f"{100 * found.mass_share:.2f} % different in the simulation"
        + (": give every link a mass above 0." if heavy else "."),
    )


def _hold_finding(chosen: Sequence[str], item: str, config_dir: Path | None) -> Finding:
    from graspbench.trial.runner import run_trial

    aspect = f"hold {item}"
    try:
        options = [*chosen, f"object={item}", "search.enabled=false"]
        if load_config(options, config_dir).hand.fingers == 2:
            options.append(TWO_FINGERS)
        result = run_trial(load_config(options, config_dir))
    except GraspbenchError as error:
        return Finding(aspect, "fault", str(error))
    if result.status == "done" and result.success:
        return Finding(aspect, "ok", f"the reference {item} is grasped, lifted and turned.")
    why = result.reason or "it was not held"
    return Finding(
        aspect,
        "fault",
        f"the reference {item} is not held: {why}; look at the posture with 'graspbench hands show', or try "
        "another object.scale.",
    )


def _massless(link: ElementTree.Element) -> bool:
    mass = link.find("inertial/mass")
    return mass is None or not _positive(mass, "value")


def _positive(element: ElementTree.Element | None, name: str) -> bool:
    try:
        return element is not None and 0.0 < float(element.get(name, 0.0)) < np.inf
    except ValueError:
        return False


def _few(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
