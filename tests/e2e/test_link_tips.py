"""A hand whose fingertips are boxes grasps with them, through the real command line."""

import pytest

from tests.hand.tip_hands import BOX, tip_hand
from tests.small import SMALL_PICTURES


@pytest.fixture
def conf(tmp_path):
    """A configuration folder with a box-tipped hand, described by hand."""
    parameters = tip_hand(tmp_path / "files", BOX)
    lines = ["name: boxes", "kind: urdf", "fingers: 3", "tip_radius_m: 0.008", "tip_shape: link"]
    lines += [f"urdf: {parameters.urdf}", "palm: {link: palm}", "chains:"]
    for finger in parameters.chains:
        place = f"tip_xyz_m: {list(finger.tip_xyz_m)}, posture_deg: {list(finger.posture_deg)}"
        lines.append(f"  - {{name: {finger.name}, tip: {finger.tip}, {place}}}")
    target = tmp_path / "conf" / "hand" / "boxes.yaml"
    target.parent.mkdir(parents=True)
    target.write_text("\n".join(lines) + "\n")
    return target.parent.parent


def test_it_is_checked_plans_verifies_and_holds(cli, tmp_path, conf):
    checked = cli("hands", "check", "boxes", "--config-dir", conf, "--no-hold", "--json")
    assert checked.code == 0, checked.stdout
    aspects = {row["aspect"]: row for row in checked.document["rows"]}
    assert "last links as they are (3 x box)" in aspects["touching"]["sentence"]
    chosen = ("hand=boxes", "object=sphere", "search.enabled=false", "record=off", *SMALL_PICTURES)
    run = cli("run", "--json", "--config-dir", conf, *chosen, "-o", tmp_path / "results")
    assert run.code == 0, run.stderr
    assert run.document["local"]["verified"]
    assert run.document["success"], run.document["execution"]["reason"]
    as_spheres = cli(
        "hands", "check", "boxes", "hand.tip_shape=sphere", "--config-dir", conf, "--no-hold", "--json"
    )
    said = {row["aspect"]: row["sentence"] for row in as_spheres.document["rows"]}["touching"]
    assert "spheres of 8.0 mm, which the description lacks at f, g, h" in said


def test_motion_in_the_hand_is_refused_before_anything_is_planned(cli, conf):
    refused = cli("manipulate", "--config-dir", conf, "hand=boxes", "motion=translate")
    assert refused.code == 2
    assert "not with hand.tip_shape=link" in " ".join(refused.stderr.split())


def test_an_imported_hand_says_what_touches(cli, tmp_path):
    path = tip_hand(tmp_path / "files", BOX).urdf
    folder = tmp_path / "conf"
    added = cli(
        "hands", "add", path, "--name", "own", "--tip-shape", "link", "--config-dir", folder, "--json"
    )
    assert added.code == 0, added.stderr
    assert added.document["tip_shape"] == "link"
    text = (folder / "hand" / "own.yaml").read_text()
    assert "tip_shape: link" in text
    assert "# The last links touch as they are, as was asked for (--tip-shape)" in text
