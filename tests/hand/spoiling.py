"""Descriptions of hands and arms with faults of every kind put in, from a seed."""

import random
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

from tests.hand.small_hands import INERTIAL, PALM, fingers, joint, one_joint_coupled, three_joints, two_joints

NUMBERS = (
    "0",
    "-1",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e-308",
    "1e9",
    "1e-9",
    "",
    "x",
    "1,5",
    "0x10",
    "٣",
    "1 2",
    "1e400",
)
_SHAPES = (
    '<mesh filename="nothing.stl"/>',
    "<mesh/>",
    '<mesh filename=""/>',
    '<mesh filename="/"/>',
    '<mesh filename="package://a/a.stl"/>',
    '<mesh filename="package://"/>',
    '<mesh filename="tip.stl" scale="0 0 0"/>',
    '<mesh filename="tip.stl" scale="0"/>',
    '<mesh filename="tip.stl" scale="-1 1 1"/>',
    '<mesh filename="tip.stl" scale="nan 1 1"/>',
    '<mesh filename="tip.stl" scale="1e6 1e6 1e6"/>',
    '<mesh filename="tip.stl" scale="1 1 0"/>',
    '<mesh filename="hand.urdf"/>',
    '<mesh filename="file://tip.stl"/>',
    '<mesh filename="http://a/tip.stl"/>',
    '<sphere radius="0"/>',
    '<sphere radius="-1"/>',
    '<sphere radius="nan"/>',
    "<sphere/>",
    '<box size="1 1"/>',
    "<box/>",
    '<box size="0 0 0"/>',
    '<box size="-1 1 1"/>',
    '<box size="1e9 1e9 1e9"/>',
    '<box size="1e-9 1e-9 1e-9"/>',
    '<cylinder radius="nan" length="1"/>',
    '<cylinder radius="0.01"/>',
    '<cylinder radius="0" length="0.1"/>',
    "<torus/>",
    "",
    '<capsule radius="0.01" length="0.02"/>',
)
_AXES = (
    "0 0 0",
    "nan 0 0",
    "1 1",
    "1e-30 0 0",
    "2 0 0",
    "1 2 3 4",
    "",
    "x y z",
    "1e200 0 0",
    "inf 0 0",
    "0 0 -1",
)
_TYPES = ("fixed", "floating", "planar", "continuous", "prismatic", "ball", "", "revolute ")
_NAMES = (
    "",
    "a b",
    "é/..",
    "&lt;",
    "x" * 500,
    "../../a",
    "palm",
    "world",
    "-1",
    "a\nb",
    "'",
    "&quot;",
    ".",
    "nan",
    "null",
)
_MIMICS = (
    '<mimic joint="{0}"/>',
    '<mimic joint="{1}"/>',
    '<mimic joint="none"/>',
    "<mimic/>",
    '<mimic joint="{1}" multiplier="0"/>',
    '<mimic joint="{1}" multiplier="nan"/>',
    '<mimic joint="{1}" multiplier="-1" offset="9"/>',
    '<mimic joint="{1}" offset="x"/>',
)


def spoilt_hand(folder: Path, rng: random.Random) -> Path:
    """Write a hand with one fault to three, and return its URDF."""
    finger = rng.choice((three_joints, three_joints, two_joints, one_joint_coupled))
    count = rng.choice((2, 3, 3, 3, 4))
    text = f'<robot name="spoilt">{PALM}{fingers(count, finger)}</robot>'
    return _spoilt(folder, "hand.urdf", text, rng)


def spoilt_arm(folder: Path, rng: random.Random) -> Path:
    """Write an arm of six or seven joints with one fault to three, and return its URDF."""
    text = f'<robot name="spoilt"><link name="base">{INERTIAL}</link>'
    above = "base"
    for k in range(rng.choice((6, 7))):
        axis = "0 0 1" if k % 2 == 0 else "0 1 0"
        text += joint(f"j{k}", above, f"l{k}", axis, at="0 0 0.15", low=-2.5, high=2.5)
        shape = '<origin xyz="0 0 0.05"/><geometry><cylinder radius="0.03" length="0.1"/></geometry>'
        text += f'<link name="l{k}">{INERTIAL}<collision>{shape}</collision></link>'
        above = f"l{k}"
    text += "</robot>"
    return _spoilt(folder, "arm.urdf", text, rng)


def _spoilt(folder: Path, name: str, text: str, rng: random.Random) -> Path:
    if rng.random() < 0.4:
        text = _with_meshes(text)
    mesh = _mesh(rng, spoil=rng.random() < 0.5)
    for _ in range(rng.choice((1, 1, 2, 3))):
        text = rng.choice(SPOIL_URDF)(text, rng)
    return _written(folder, name, text, mesh)


def spoilt_mjcf(folder: Path, text: str, rng: random.Random) -> Path:
    """Write a hand of MuJoCo's format, that is given, with one fault to three, and return its file."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        text = rng.choice(SPOIL_MJCF)(text, rng)
    return _written(folder, "hand.xml", text, _mesh(rng, spoil=rng.random() < 0.5))


def _written(folder: Path, name: str, text: str, mesh: bytes) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "tip.stl").write_bytes(mesh)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def _with_meshes(text: str) -> str:
    """Return a description whose longest-named kind of shapes, cylinders, are meshes on the last links."""
    return re.sub(
        r'(<link name="\w+_c">.*?<geometry>)<cylinder [^>]*/>', r'\1<mesh filename="tip.stl"/>', text
    )


def _mesh(rng: random.Random, *, spoil: bool) -> bytes:
    body = trimesh.creation.cylinder(0.006, 0.055, sections=12)
    body.apply_translation((0.0, 0.0, 0.0275))
    if not spoil:
        return bytes(trimesh.exchange.stl.export_stl(body))
    kind = rng.choice(("cut", "empty", "flat", "nan", "huge", "point", "bytes", "text", "counts"))
    if kind == "flat":
        body.vertices[:, 0] = 0.0
    elif kind == "nan":
        body.vertices[rng.randrange(len(body.vertices))] = np.nan
    elif kind == "huge":
        body.vertices *= 1e30
    elif kind == "point":
        body.vertices[:] = 0.01
    with np.errstate(all="ignore"):
        content = bytearray(trimesh.exchange.stl.export_stl(body))
    if kind == "cut":
        del content[rng.randrange(len(content)) :]
    elif kind == "empty":
        content.clear()
    elif kind == "bytes":
        for _ in range(20):
            content[rng.randrange(len(content))] = rng.randrange(256)
    elif kind == "text":
        content = bytearray(b"solid a\nfacet normal 0 0 x\nouter loop\nvertex 1 2\nendsolid a\n")
    elif kind == "counts":
        content[80:84] = b"\xff\xff\xff\x7f"
    return bytes(content)


def _replaced(text: str, pattern: str, values: tuple[str, ...], rng: random.Random) -> str:
    """Replace the second group of one match to four, wherever they are."""
    found = list(re.finditer(pattern, text, re.DOTALL))
    for one in sorted(rng.sample(found, min(len(found), rng.randint(1, 4))), key=lambda each: -each.start()):
        text = text[: one.start(2)] + rng.choice(values) + text[one.end(2) :]
    return text


def _of_attributes(pattern: str, values: tuple[str, ...]) -> Callable[[str, random.Random], str]:
    return lambda text, rng: _replaced(text, rf'\b({pattern})="([^"]*)"', values, rng)


def _part(text: str, pattern: str, new: str, rng: random.Random) -> str:
    """Replace a whole match."""
    found = list(re.finditer(pattern, text, re.DOTALL))
    if not found:
        return text
    one = rng.choice(found)
    return text[: one.start()] + new + text[one.end() :]


def _shapes(text: str, rng: random.Random) -> str:
    return _part(text, r"<(cylinder|sphere|box|mesh) [^>]*/>", rng.choice(_SHAPES), rng)


def _axes(text: str, rng: random.Random) -> str:
    new = rng.choice((f'<axis xyz="{rng.choice(_AXES)}"/>', "<axis/>", ""))
    return _part(text, r'<axis xyz="[^"]*"/>', new, rng)


def _names(text: str, rng: random.Random) -> str:
    known = tuple(re.findall(r'(?:name|link)="([^"]*)"', text))
    return _replaced(text, r'\b(name|link|joint)="([^"]*)"', (rng.choice(known), rng.choice(_NAMES)), rng)


def _trees(text: str, rng: random.Random) -> str:
    if rng.random() < 0.4:
        kind = rng.choice(_TYPES)
        return re.sub('type="revolute"', f'type="{kind}"', text, count=rng.randint(1, 9))
    pattern = r"<joint .*?</joint>|<link .*?</link>|<(parent|child) [^>]*/>|<limit [^>]*/>|<origin [^>]*/>"
    found = list(re.finditer(pattern, text, re.DOTALL))
    one = rng.choice(found)
    again = one.group(0) if rng.random() < 0.3 else ""
    return text[: one.start()] + 2 * again + text[one.end() :]


def _mimic(text: str, rng: random.Random) -> str:
    joints = re.findall(r'<joint name="([^"]*)"', text)
    new = rng.choice(_MIMICS).format(rng.choice(joints), rng.choice(joints)) + "</joint>"
    return _part(text, r"</joint>", new, rng)


def _bytes(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(("", "<", "\0", "&", ">", "]]>", "\ufeff")) + text[at + rng.randrange(40) :]


def _inertials(text: str, rng: random.Random) -> str:
    return _part(text, r"<inertial>.*?</inertial>|<inertial [^>]*/>", rng.choice(("", "<inertial/>")), rng)


def _bodies(text: str, rng: random.Random) -> str:
    """Take out, or double, an element of a file of MuJoCo's format."""
    found = list(re.finditer(r"<(geom|joint|inertial) [^>]*/>", text))
    one = rng.choice(found)
    again = one.group(0) if rng.random() < 0.4 else ""
    return text[: one.start()] + 2 * again + text[one.end() :]


def _geoms(text: str, rng: random.Random) -> str:
    kinds = ("plane", "hfield", "sphere", "ellipsoid", "cylinder", "box", "mesh", "sdf", "x")
    return _replaced(text, r'\b(type)="([^"]*)"', (rng.choice(kinds),), rng)


def _mesh_geom(text: str, rng: random.Random) -> str:
    asset = '<asset><mesh name="m" file="tip.stl"/></asset></mujoco>'
    geom = '<geom type="mesh" mesh="m" mass="0.01"/>'
    return _part(text, "<geom [^>]*capsule[^>]*/>", geom, rng).replace("</mujoco>", asset)


def _equalities(text: str, rng: random.Random) -> str:
    one = rng.choice(
        (
            '<joint joint1="f2" joint2="f3" polycoef="0.1 1 0 0 0"/>',
            '<joint joint1="f2" joint2="g2" polycoef="0 0 0 0 0"/>',
            '<joint joint1="f2"/>',
            '<joint joint1="f2" joint2="f3" polycoef="0 1 2 0 0"/>',
            '<connect body1="f_c" body2="g_c" anchor="0 0 0"/>',
            '<joint joint1="f3" joint2="f2" polycoef="9 -1 0 0 0"/>',
        )
    )
    return text.replace("</mujoco>", f"<equality>{one}</equality></mujoco>")


SPOIL_URDF: tuple[Callable[[str, random.Random], str], ...] = (
    _of_attributes("lower|upper|effort|velocity", NUMBERS),
    _of_attributes("ixx|ixy|iyy|izz|value", NUMBERS),
    _of_attributes("xyz|rpy", (*_AXES, "1e9 0 0", "0 0 1e308")),
    _of_attributes("radius|length|size", NUMBERS),
    _inertials,
    _shapes,
    _axes,
    _names,
    _trees,
    _mimic,
    _bytes,
)

SPOIL_MJCF: tuple[Callable[[str, random.Random], str], ...] = (
    _of_attributes(
        "range|actuatorfrcrange|mass|diaginertia", (*NUMBERS, "1 -1", "0 0", "nan nan", "1e9 2e9")
    ),
    _of_attributes("pos|axis|euler|size|fromto", (*_AXES, *NUMBERS, "0 0 0 0 0 0")),
    _names,
    _bodies,
    _geoms,
    _mesh_geom,
    _mesh_geom,
    _equalities,
    _bytes,
)
