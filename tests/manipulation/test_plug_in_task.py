"""A compiled task of another distribution: one file, found, compiled and obeyed in its own process."""

import os
import subprocess
import sys
from pathlib import Path

PLUG_IN = Path(__file__).parent / "plug_in"
ROOT = Path(__file__).parents[2]

PROGRAM = """
import numpy as np
from graspbench.errors import ConfigurationError
from graspbench.manipulation import charts
from graspbench.manipulation.clik import Clik, ClikParameters
from graspbench.manipulation.contact_kinematics import Contact, ManipulationSystem
from graspbench.manipulation.motion import Segment, Trajectory, line
from graspbench.manipulation.secondary_task import TASKS, build_tasks
from tests.manipulation.cases import random_tree
from tests.oracles.prioritised_velocity import prioritised_velocity

assert "tip_height" in TASKS.names()
rng = np.random.default_rng(0)
contacts = [Contact(charts.sphere(0.05), "hard", 0.01)] * 4
system = ManipulationSystem(random_tree(rng, fingers=4, joints=8), contacts)
path = Trajectory([Segment(1.0, 0.0, line(np.zeros(3), np.ones(3) / 50), np.zeros(3))], np.eye(3))
options = {"kind": "tip_height", "gain": 3.0, "fingers": (0, 2), "floor_m": 0.1, "start_s": -9.0}
law = Clik(system, path, ClikParameters(), build_tasks({"lift": options}))
seen = 0
for _ in range(20):
    joints, variables = rng.uniform(-1, 1, system.n_joints), rng.uniform(-0.5, 0.5, (4, 5))
    velocity = law.velocity(0.5, joints, variables)
    depth = 0.1 - law.state.tip_positions[[0, 2], 2]
    rows = []
    for finger, deep in zip((0, 2), depth):
        if deep > 0.0:
            row = np.zeros((1, system.n_variables))
            row[0, : system.n_joints] = law.state.tip_jacobians[finger, 2]
            x = min(deep / 0.01, 1.0)
            rows.append((row, np.array([3.0 * deep]), x**3 * (10 - 15 * x + 6 * x * x)))
    seen += len(rows)
    expected = prioritised_velocity(law.state.jacobian, law.wanted, law.scale, rows)
    np.testing.assert_allclose(velocity, expected, atol=1e-9 * max(1.0, np.abs(expected).max()))
assert seen > 10, seen
try:
    Clik(system, path, ClikParameters(), build_tasks({"lift": {**options, "fingers": (7,)}}))
except ConfigurationError as error:
    assert "names fingers 7 but there are 4" in str(error)
else:
    raise AssertionError("a finger that there is not was taken")
print("obeyed")
"""


def test_a_compiled_task_from_outside_the_package_is_one_file(tmp_path):
    paths = os.pathsep.join([str(PLUG_IN), str(ROOT)])
    environment = {**os.environ, "PYTHONPATH": paths, "PYTHONPYCACHEPREFIX": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "obeyed\n"
