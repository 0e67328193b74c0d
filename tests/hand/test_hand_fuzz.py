"""Spoilt hand files: read, or refused in one sentence; never a traceback."""

import random
import re

import numpy as np
import pytest

from graspbench.errors import GraspbenchError
from graspbench.hand.importing.importer import Guesses, import_hand
from tests.fuzz import Budget
from tests.hand.small_hands import PALM, fingers, three_joints

TRIALS = Budget(12).count
_PARTS = r"<joint .*?</joint>|<link .*?</link>|<(parent|child) [^>]*/>|<limit [^>]*/>"
NUMBERS = ("0", "-1", "nan", "inf", "1e308", "-1e-308", "", "x", "1,5", "0x10", "٣")


def spoil(text: str, rng: random.Random) -> str:
    kind = rng.choice(("limits", "inertia", "meshes", "axes", "names", "trees", "bytes"))
    if kind == "limits":
        return replaced(text, r'(lower|upper|effort|velocity)="[^"]*"', rng)
    if kind == "inertia":
        return replaced(text, r'(ixx|ixy|iyy|izz|value)="[^"]*"', rng)
    if kind == "meshes":
        mesh = rng.choice(
            (
                '<mesh filename="nothing.stl"/>', "<mesh/>", '<mesh filename="package://a/a.stl" scale="0"/>',
                '<sphere radius="0"/>', '<sphere radius="-1"/>', '<box size="1 1"/>', "<sphere/>", "<torus/>",
                '<cylinder radius="nan" length="1"/>', '<mesh filename="/"/>', '<box size="1e9 1e9 1e9"/>',
            )
        )  # fmt: skip
        found = list(re.finditer(r"<cylinder [^>]*/>", text))
        one = rng.choice(found)
        return text[: one.start()] + mesh + text[one.end() :]
    if kind == "axes":
        axis = rng.choice(("0 0 0", "nan 0 0", "1 1", "1e-30 0 0", "2 0 0", "1 2 3 4", ""))
        found = list(re.finditer(r'<axis xyz="[^"]*"/>', text))
        one = rng.choice(found)
        return text[: one.start()] + rng.choice((f'<axis xyz="{axis}"/>', "<axis/>", "")) + text[one.end() :]
    if kind == "names":
        found = list(re.finditer(r'(name|link)="([^"]*)"', text))
        one, other = rng.choice(found), rng.choice(found)
        name = rng.choice((other.group(2), "", "a b", "é/..", "<", "x" * 500)).replace("<", "&lt;")
        return text[: one.start()] + f'{one.group(1)}="{name}"' + text[one.end() :]
    if kind == "trees":
        found = list(re.finditer(_PARTS, text))
        one = rng.choice(found)
        again = one.group(0) if rng.random() < 0.3 else ""
        types = ("fixed", "floating", "planar", "continuous", "prismatic", "ball", "")
        if rng.random() < 0.4:
            return re.sub('type="revolute"', f'type="{rng.choice(types)}"', text, count=rng.randint(1, 9))
        return text[: one.start()] + 2 * again + text[one.end() :]
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(("", "<", "\0", "&", ">", "]]>")) + text[at + rng.randrange(40) :]


def replaced(text: str, pattern: str, rng: random.Random) -> str:
    found = list(re.finditer(pattern, text))
    for one in sorted(rng.sample(found, rng.randint(1, 4)), key=lambda each: -each.start()):
        text = text[: one.start()] + f'{one.group(1)}="{rng.choice(NUMBERS)}"' + text[one.end() :]
    return text


@pytest.mark.parametrize("seed", range(TRIALS))
def test_a_spoilt_file_is_read_or_refused_in_one_sentence(tmp_path, seed, capfd):
    rng = random.Random(seed)
    text = f'<robot name="spoilt">{PALM}{fingers(3, three_joints)}</robot>'
    for _ in range(rng.randint(1, 2)):
        text = spoil(text, rng)
    path = tmp_path / "spoilt.urdf"
    path.write_text(text, encoding="utf-8")
    try:
        found = import_hand(path, "spoilt", Guesses())
    except GraspbenchError as error:
        said = str(error)
        assert "\n" not in said
        assert said.endswith(".")
        assert "Traceback" not in said
    else:
        hand = found.hand
        assert np.all(np.isfinite(hand.tip_positions(hand.preferred)))
        assert np.all(hand.lower < hand.upper)
        assert all(np.isfinite(each.mass) for each in hand.model.inertias)
    out, err = capfd.readouterr()
    assert out == ""
    assert err == ""
