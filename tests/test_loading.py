"""How a process begins and ends."""

import subprocess
import sys

ENDING = """
import gc, sys
from graspbench.cli.start import main
sys.argv = ["graspbench", "--version"]
try:
    main()
finally:
    print(gc.get_freeze_count() > 0, gc.get_threshold()[0])
"""


def test_the_command_looks_for_garbage_rarely_and_never_on_its_way_out():
    done = subprocess.run([sys.executable, "-c", ENDING], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "True 100000"


SOLVER_IN_A_CYCLE = """
from proxsuite import proxqp
class Cycle: pass
cycle = Cycle()
cycle.itself, cycle.solver = cycle, proxqp.dense.QP(2, 0, 2)
"""


def test_no_library_complains_of_what_is_left():
    program = SOLVER_IN_A_CYCLE + ENDING
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert done.stdout.splitlines()[-1] == "False 100000"
