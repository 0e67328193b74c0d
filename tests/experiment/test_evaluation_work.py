"""Evaluation in portions: the same with any number of processes, and what dies harms no other."""

import os
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from graspbench.config.protocols import load_evaluation
from graspbench.experiment.evaluation_work import evaluated_portions, split_work
from graspbench.experiment.hand_and_object import hand_and_object
from tests.evaluation.scene import known


@dataclass(frozen=True)
class Deadly:
    """A protocol that takes its process with it."""

    description: ClassVar[str] = "none"
    unit: ClassVar[str] = "1"

    def run(self, stand, record, judgement, seed):
        os._exit(9)


def test_portions_are_of_one_scale_and_hold_every_grasp_once():
    config = hand_and_object("allegro", "bottle", (), None)
    records = [replace(known()[i % 8], object_scale=(1.0, 1.2)[i % 2]) for i in range(50)]
    work = list(split_work(records, config, load_evaluation(["protocol=none"]), 0))
    assert sorted(number for each in work for number in each.numbers) == list(range(50))
    for each in work:
        assert {record.object_scale for record in each.records} == {each.object.scale}
        assert len(each.records) <= 20


def test_a_portion_whose_process_dies_harms_no_other():
    config = hand_and_object("allegro", "bottle", (), None)
    parameters = load_evaluation(["protocol=none"])
    deadly = replace(parameters, protocols={"deadly": Deadly()})
    records = known()[:2]
    (safe,), (fatal,) = (list(split_work(records, config, each, 0)) for each in (parameters, deadly))
    first, lost, last = evaluated_portions([safe, fatal, safe], 2)
    assert first == last
    assert [row["status"] for row in first] == ["done", "done"]
    assert [row["status"] for row in lost] == ["crashed", "crashed"]
    assert "the process ended with code" in lost[0]["reason"]


@dataclass(frozen=True)
class Endless:
    """A protocol that tells where it is and does not end."""

    folder: str = ""
    description: ClassVar[str] = "none"
    unit: ClassVar[str] = "1"

    def run(self, stand, record, judgement, seed):
        (Path(self.folder) / str(os.getpid())).touch()
        time.sleep(300.0)


def test_workers_end_when_nobody_wants_the_rest(tmp_path):
    config = hand_and_object("allegro", "bottle", (), None)
    parameters = load_evaluation(["protocol=none"])
    endless = replace(parameters, protocols={"endless": Endless(str(tmp_path))})
    (quick,), (slow,) = (list(split_work(known()[:1], config, each, 0)) for each in (parameters, endless))
    rows = evaluated_portions([quick, slow], 2)
    next(rows)
    end = time.monotonic() + 60.0
    while not (workers := list(tmp_path.iterdir())):
        assert time.monotonic() < end
        time.sleep(0.05)
    rows.close()  # as an interrupt does
    assert not Path(f"/proc/{workers[0].name}").exists()
