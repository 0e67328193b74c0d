"""A hand's description as a commented YAML file."""

from collections.abc import Sequence

from graspbench.hand.importing.importer import ImportedHand
from graspbench.hand.parameters import FingerDescription, TipShape


def description_text(found: ImportedHand, source: str) -> str:
    """Return the file of the configuration group ``hand``, every guess with a comment that says why.

    Args:
        found: The hand as it was read.
        source: The file that it was read from.
    """
    p, o, tree = found.parameters, found.opposition, found.structure
    lines = [
        f"# Hand '{p.name}', read from {source}.",
        f"# 'graspbench hands check {p.name}' says what is wrong with it, 'graspbench hands show' draws it.",
        "# Everything below was found in the file and may be changed here.",
        f"name: {_text(p.name)}",
        "kind: urdf",
        f"urdf: {_text(p.urdf or '')}",
    ]
    if p.package_dirs:
        lines.append(f"package_dirs: [{', '.join(_text(folder) for folder in p.package_dirs)}]")
    lines += [
        f"# Of {len(p.chains)} fingers: as many as oppose, and as reach contacts evenly around a body.",
        f"fingers: {p.fingers}",
        *_what_touches(p.tip_shape),
        "# The spheres at the tips. They come from: "
        + "; ".join(f"{name}: {tip.source}" for name, tip in found.tips.items())
        + ".",
        f"tip_radius_m: {_number(p.tip_radius_m)}",
        f"# The palm: '{tree.palm}' is the last link that all fingers have in common. In the palm frame z",
        "# points to the object, across the opposing tips' plane; its origin is on the palm's shapes.",
        f"palm: {{link: {_text(p.palm.link)}, xyz_m: {_row(p.palm.xyz_m)}, rpy_deg: {_row(p.palm.rpy_deg)}}}",
        f"# The posture closes around an object of {2e3 * o.gap_m:.0f} mm; the tips' mean direction from its",
        f"# middle has the length {o.imbalance:.2f} (0: they oppose each other perfectly). Angles in deg,",
        "# slides in mm; at rest a finger is out of the way. Joints that follow another are left out.",
        "chains:",
        *(f"  - {_chain(finger)}" for finger in p.chains),
    ]
    if p.subsets:
        lines += ["# Those that oppose each other best; the one against the others comes first.", "subsets:"]
        lines += [
            f"  {size}: [{', '.join(_text(name) for name in names)}]"
            for size, names in sorted(p.subsets.items())
        ]
    if tree.wrist:
        lines.append(
            f"# Joints of arm and wrist ({', '.join(tree.wrist)}) are held at 0, or as locked_deg says."
        )
    if tree.shared:
        lines.append(f"# Joints that move several fingers are held: {', '.join(tree.shared)}.")
    if p.locked_deg:
        held = ", ".join(f"{_text(name)}: {_number(value)}" for name, value in p.locked_deg.items())
        lines.append(f"locked_deg: {{{held}}}")
    return "\n".join(lines) + "\n"


def _what_touches(shape: TipShape) -> list[str]:
    """Return what touches, and why."""
    if shape == "link":
        said = ["# The last links touch as they are, as was asked for (--tip-shape); where the spheres below"]
        said += ["# are is about where. 'sphere': these touch, also where the links are not round."]
    else:
        said = ["# Spheres touch: they follow the links' pads (below), and in-hand motion rolls on them."]
        said += ["# 'link': the last links touch as they are, and the wrist helps to place them."]
    return [*said, f"tip_shape: {shape}"]


def _chain(finger: FingerDescription) -> str:
    parts = [f"name: {_text(finger.name)}", f"tip: {_text(finger.tip)}"]
    parts.append(f"tip_xyz_m: {_row(finger.tip_xyz_m)}")
    parts.append(f"posture_deg: {_row(finger.posture_deg or ())}")
    parts.append(f"rest_deg: {_row(finger.rest_deg or ())}")
    return "{" + ", ".join(parts) + "}"


def _row(values: Sequence[float]) -> str:
    return f"[{', '.join(_number(value) for value in values)}]"


def _number(value: float) -> str:
    text = f"{float(value):.6f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _text(value: str) -> str:
    return "'" + value.replace("'", "''") + "'"
