"""``graspbench hands`` through the real command line."""

from pathlib import Path

import pytest

from tests.hand.small_hands import PALM, fingers, parallel_gripper, three_joints, written


def test_a_hand_is_added_listed_checked_and_drawn(cli, tmp_path):
    conf = tmp_path / "conf"
    path = written(tmp_path / "own.urdf", PALM + fingers(3, three_joints))
    added = cli("hands", "add", path, "--name", "mine", "--config-dir", conf, "--json")
    assert added.code == 0, added.stderr
    assert set(added.document["fingers"]) == {"f", "g", "h"}
    assert Path(added.document["picture"]).stat().st_size > 5000
    listed = cli("hands", "list", "--config-dir", conf, "--json").document
    assert next(row for row in listed if row["name"] == "mine")["joints"] == 9
    checked = cli("hands", "check", "mine", "--config-dir", conf, "--no-hold", "--json")
    assert checked.code == 0, checked.stdout
    aspects = {row["aspect"]: row for row in checked.document["rows"]}
    assert {"inertia", "effort", "meshes", "workspace", "singular values", "opposition"} <= set(aspects)
    assert all(row["sentence"].endswith(".") for row in checked.document["rows"])
    shown = cli("hands", "show", "mine", "--config-dir", conf, "-o", tmp_path / "pictures", "--json")
    assert Path(shown.document["picture"]).is_file()


def test_a_fault_is_said_and_ends_with_1(cli, tmp_path):
    conf = tmp_path / "conf"
    text = (PALM + fingers(3, three_joints)).replace('lower="-0.2" upper="1.6"', 'lower="0" upper="3.1416"')
    path = written(tmp_path / "own.urdf", text)
    assert cli("hands", "add", path, "--name", "mine", "--config-dir", conf).code == 0
    turned = cli("hands", "check", "mine", "hand.palm.rpy_deg=[180,0,0]", "--config-dir", conf, "--no-hold")
    assert turned.code == 1
    said = " ".join(turned.stdout.split())
    assert "behind the palm frame" in said
    assert "3 of 9 joints turn by 170 deg or more (f3, g3, h3)" in said


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "does not exist"),
        ("<robot", "cannot be read"),
        ("<sdf/>", "is no URDF"),
        ('<robot name="a"><link name="b"/></robot>', "nothing moves there"),
    ],
)
def test_what_is_no_hand_is_refused(cli, tmp_path, content, said):
    path = tmp_path / "own.urdf"
    if content is not None:
        path.write_text(content)
    refused = cli("hands", "add", path, "--config-dir", tmp_path / "conf")
    assert refused.code == 2
    assert said in " ".join(refused.stderr.split())
    assert not list((tmp_path / "conf").rglob("*.yaml"))


def test_two_fingers_are_told_which_contacts_they_need(cli, tmp_path):
    path = parallel_gripper(tmp_path / "gripper.urdf")
    added = cli("hands", "add", path, "--config-dir", tmp_path / "conf")
    assert added.code == 0, added.stderr
    assert "quality.contact=soft_finger" in added.stdout
