"""What carries the hand, through the real command line."""

import pytest
import yaml

PANDA = "package://pybullet_data/franka_panda/panda.urdf"
QUICK = (
    "object=cylinder", "search.enabled=false", "record=off", "camera.width=240", "camera.height=180",
    "camera.fx=260", "camera.fy=260", "stations.inner.count=0", "execution.hold_time_s=0.1",
)  # fmt: skip


def test_an_arm_of_ones_own_is_added_listed_and_carries_the_hand(cli, tmp_path):
    conf = tmp_path / "conf"
    added = cli("arms", "add", PANDA, "--name", "mine", "--config-dir", conf, "--json")
    assert added.code == 0, added.stderr
    assert (added.document["joints"], added.document["tip"]) == (7, "panda_link7")
    described = yaml.safe_load((conf / "arm" / "mine.yaml").read_text())
    assert described["flange_xyz_m"][2] == pytest.approx(0.107, abs=1e-3)  # the data sheet's
    listed = {row["name"]: row for row in cli("arms", "list", "--config-dir", conf, "--json").document}
    assert set(listed) == {"floating", "kuka", "mine"}
    finished = cli("run", "--config-dir", conf, "arm=mine", *QUICK, "-o", tmp_path / "r", "--json")
    assert finished.code == 0, finished.stderr
    assert finished.document["success"] is True, finished.document["execution"]["reason"]
    assert finished.document["choice"]["arm"] == "mine"
    assert finished.document["execution"]["palm_error_max_m"] < 2e-3
    assert finished.document["times_s"]["arm_placement"] > 0.0


def test_the_kuka_carries_the_hand(cli, tmp_path):
    finished = cli("run", "arm=kuka", *QUICK, "-o", tmp_path / "r", "--json")
    assert finished.code == 0, finished.stderr
    assert finished.document["success"] is True, finished.document["execution"]["reason"]


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("execution.mount=kuka", "the option 'execution.mount' is now the group 'arm'"),
        ("arm=robot", "unknown arm 'robot'"),
        ("arm.urdf=no.urdf", "the URDF 'no.urdf' of arm 'floating' does not exist"),
        ("arm.urdf=package://example-robot-data/robots/so_arm_description/urdf/so100.urdf", None),
    ],
)
def test_what_cannot_carry_the_hand_is_said(cli, tmp_path, option, said):
    if said is None:  # five joints and a jaw: the jaw carries no hand
        option, said = (option, "arm.tip=gripper"), "has 5 joint(s) between"
    else:
        option = (option,)
    refused = cli("run", *option, *QUICK, "-o", tmp_path / "r")
    assert refused.code == 2
    assert said in " ".join(refused.stderr.split())
    assert refused.stderr.count("\n") <= 30


def test_a_stored_trial_with_the_old_name_is_told_the_new_one(cli, tmp_path):
    stored = tmp_path / "config.yaml"
    stored.write_text(yaml.safe_dump({"execution": {"mount": "kuka"}}))
    refused = cli("run", "--config", stored, "-o", tmp_path / "r")
    assert refused.code == 2
    assert "arm=kuka" in refused.stderr
