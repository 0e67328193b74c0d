"""Spoilt files of hands and arms: read and used, or refused in one sentence; nothing is half written.

With GRASPBENCH_FUZZ=100 in the environment so many files are tried instead of a few, from the seed
GRASPBENCH_FUZZ_SEED on; what is read is then also checked and planned with.
"""

import importlib.util
import os
import random
import time
from pathlib import Path

import numpy as np
import pytest

from graspbench.config.trial_config import load_config
from graspbench.hand import load_hand
from graspbench.hand.parameters import HandParameters
from graspbench.simulation.mounts.arm_model import carrying_arms
from tests.fuzz import Budget
from tests.hand.spoiling import spoilt_arm, spoilt_hand, spoilt_mjcf
from tests.hand.test_importing import write_mjcf

HANDS, MJCF, ARMS = Budget(6), Budget(3), Budget(4)
FIRST = int(os.environ.get("GRASPBENCH_FUZZ_SEED", "") or 0)
USED = 2 if HANDS.count == 6 else HANDS.count
"""So many of the hands that are read are planned with too."""

QUICK = (
    "object=cylinder", "search.enabled=false", "record=off", "camera.width=240", "camera.height=180",
    "camera.fx=260", "camera.fy=260", "stations.inner.count=0", "execution.until=off",
)  # fmt: skip
NO_MUJOCO = importlib.util.find_spec("mujoco") is None


def seeds(budget: Budget) -> range:
    return range(FIRST, FIRST + budget.count)


def refused_well(finished, path: Path, *, names: str) -> str:
    """Return the one sentence that a refusal is."""
    said = unhurried(finished)
    assert finished.code == 2, said
    assert finished.stdout == ""
    assert "Traceback" not in said
    lines = said.strip().split("\n")
    assert len(lines) == 1, said
    assert lines[0].startswith("graspbench: "), said
    assert lines[0].endswith("."), said
    assert "unexpected" not in said
    assert names in said or path.name in said, said  # what it is about
    assert ": " in lines[0].removeprefix("graspbench: "), said  # what to do
    return lines[0]


def unhurried(finished) -> str:
    """Return what was said, without what is told of commands that take their time."""
    return "".join(line for line in finished.stderr.splitlines(True) if not line.endswith(" so far\n"))


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def conf(tmp_path):
    """A folder in which there is a hand, and an arm, of the name that is going to be added."""
    folder = tmp_path / "conf"
    for file in (
        "hand/spoilt.yaml",
        "hand/spoilt/spoilt.urdf",
        "hand/spoilt/meshes/a.stl",
        "arm/spoilt.yaml",
    ):
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text("name: before\n")
    return folder


def add(cli, conf, path, *, what: str) -> bool:
    """Add a hand or an arm; tell whether it was read."""
    before = files_in(conf)
    started = time.process_time()
    added = cli(what, "add", path, "--name", "spoilt", "--config-dir", conf)
    print(f"add {what} {added.code} {time.process_time() - started:.1f}s {added.stderr.strip()[:400]}")
    if added.code == 0:
        assert unhurried(added) == ""
        assert not [
            file for file in files_in(conf) if "partial" in file or file.split("/")[-1].startswith(".")
        ]
        return True
    refused_well(added, path, names="'spoilt'")
    assert files_in(conf) == before
    return False


def use(cli, conf, path: Path, folder: Path) -> None:
    """Check a hand that was read, and plan with it."""
    hand = load_hand(load_config(["hand=spoilt", "record=off"], conf).hand)
    assert np.all(np.isfinite(hand.tip_positions(hand.preferred)))
    assert np.all(hand.lower < hand.upper)
    assert all(np.isfinite(each.mass) for each in hand.model.inertias)
    started = time.process_time()
    checked = cli("hands", "check", "spoilt", "--no-hold", "--config-dir", conf, "--json")
    print(f"check {checked.code} {time.process_time() - started:.1f}s")
    if checked.code == 2:
        refused_well(checked, path, names="'spoilt'")
    else:
        assert checked.code in (0, 1), checked.stderr
        assert unhurried(checked) == ""
        assert all(row["sentence"].endswith(".") for row in checked.document["rows"])
    started = time.process_time()
    contact = ("quality.contact=soft_finger",) if hand.n_fingers == 2 else ()
    run = cli("run", "--config-dir", conf, "hand=spoilt", *QUICK, *contact, "-o", folder, "--json")
    print(f"run {run.code} {time.process_time() - started:.1f}s")
    if run.code == 2:
        refused_well(run, path, names="'spoilt'")
        assert not folder.exists() or not list(folder.glob("*/result.json"))
    else:
        assert run.code in (0, 1), run.stderr
        assert "Traceback" not in run.stderr
        print(run.document["status"], run.document["reason"])
        assert run.document["status"] == ("done" if run.code == 0 else "failed")
        assert "unexpected" not in str(run.document["reason"])


def is_used(seed: int) -> bool:
    return seed - FIRST < USED


@pytest.mark.parametrize("seed", seeds(HANDS))
def test_a_spoilt_urdf_is_used_or_refused_in_one_sentence(cli, conf, tmp_path, seed, capfd):
    path = spoilt_hand(tmp_path / "file", random.Random(seed))
    if add(cli, conf, path, what="hands") and is_used(seed):
        use(cli, conf, path, tmp_path / "r")
    assert_silent(capfd)


@pytest.mark.skipif(NO_MUJOCO, reason="no MuJoCo here (tests/system-tools installs it)")
@pytest.mark.parametrize("seed", seeds(MJCF))
def test_a_spoilt_mjcf_is_used_or_refused_in_one_sentence(cli, conf, tmp_path, seed, capfd):
    text = write_mjcf(tmp_path / "whole.xml").read_text()
    path = spoilt_mjcf(tmp_path / "file", text, random.Random(seed))
    if add(cli, conf, path, what="hands") and is_used(seed) and USED > 2:
        use(cli, conf, path, tmp_path / "r")
    assert_silent(capfd)


# 1007 states a speed beyond what the option may have.
@pytest.mark.parametrize("seed", sorted({*seeds(ARMS), 1007}))
def test_a_spoilt_arm_is_read_or_refused_in_one_sentence(cli, conf, tmp_path, seed, capfd):
    path = spoilt_arm(tmp_path / "file", random.Random(seed))
    if add(cli, conf, path, what="arms"):
        listed = cli("arms", "list", "--config-dir", conf, "--json")
        assert listed.code == 0, listed.stderr
        assert "joints" in next(row for row in listed.document if row["name"] == "spoilt")
        arm = load_config(["arm=spoilt", "record=off"], conf).arm
        for model in carrying_arms(arm, load_hand(HandParameters(kind="radial")), np.eye(4)):
            assert np.all(np.isfinite(model.palm_pose(0.5 * (model.lower + model.upper))))
            assert np.isfinite(model.reach_m)
    assert_silent(capfd)


def assert_silent(capfd) -> None:
    """Nothing but the program writes: libraries in C say nothing."""
    out, err = capfd.readouterr()
    told = [
        line for line in out.splitlines() if not line.startswith(("add ", "check ", "run ", "done", "failed"))
    ]
    print(out)
    assert told == []
    assert err == ""
