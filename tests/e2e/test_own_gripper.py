"""A gripper whose fingers follow each other grasps, lifts and turns an object."""

from tests.hand.small_hands import parallel_gripper


def test_a_parallel_gripper_holds_the_cylinder(cli, tmp_path):
    conf = tmp_path / "conf"
    path = parallel_gripper(tmp_path / "gripper.urdf")
    assert cli("hands", "add", path, "--config-dir", conf).code == 0
    chosen = ("hand=gripper", "object=cylinder", "quality.contact=soft_finger", "search.enabled=false")
    run = cli("run", "--json", "--config-dir", conf, *chosen, "record=off", "-o", tmp_path / "results")
    assert run.code == 0, run.stderr
    assert run.document["local"]["verified"]
    assert run.document["success"], run.document["execution"]["reason"]
