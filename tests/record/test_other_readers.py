"""The log read by programs that are not ours: npm's @mcap/core and Rerun's checker."""

import json
import os
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from graspbench.record import CHANNELS, log_info
from tests.record.test_mcap_log import write

TOOLS = Path(__file__).parents[1] / ".tools"
NODE = shutil.which("node") is not None and (TOOLS / "node_modules/@mcap/core").is_dir()


@pytest.mark.skipif(not NODE, reason="no node with @mcap/core here (tests/system-tools installs it)")
def test_mcap_core_reads_every_message(tmp_path, trial):
    path = write(tmp_path / "trial.mcap", trial)
    command = ["node", Path(__file__).parent / "read_log.mjs", path, TOOLS]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {"messages": log_info(path).messages, "attachments": ["config.yaml"]}


@pytest.mark.skipif(not (TOOLS / "rerun").is_dir(), reason="no rerun here (tests/system-tools installs it)")
def test_rerun_finds_nothing_wrong(tmp_path, trial):
    path = write(tmp_path / "trial.mcap", trial)
    environment = {**os.environ, "PYTHONPATH": str(TOOLS / "rerun")}
    command = [sys.executable, "-m", "rerun", "mcap", "check", path]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [line.split() for line in done.stdout.splitlines() if " /" in line]
    assert {row[3] for row in rows} == set(log_info(path).messages)
    assert {row[0] for row in rows} == {"ok"}


def test_the_foxglove_layout_shows_topics_of_the_log():
    layout = json.loads(files("graspbench.record").joinpath("foxglove_layout.json").read_text())
    panels = layout["configById"]
    topics = set(panels["3D!graspbench"]["topics"]) | {panels["RawMessages!graspbench"]["topicPath"]}
    image = panels["Image!graspbench"]["imageMode"]
    topics |= {image["imageTopic"], image["calibrationTopic"], *image["annotations"]}
    assert topics <= set(CHANNELS)
    placed: list[str] = []
    stack = [layout["layout"]]
    while stack:
        node = stack.pop()
        placed += [node] if isinstance(node, str) else []
        stack += [node["first"], node["second"]] if isinstance(node, dict) else []
    assert sorted(placed) == sorted(panels)
