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
