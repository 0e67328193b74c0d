"""Where the program begins: signals are heard before anything else is loaded."""

import sys

from graspbench.cli.ending import end_on_signals
from graspbench.garbage import collect_rarely


def main() -> None:
    """Run the command line; a signal that comes while it is being loaded ends it like any other."""
    try:
        end_on_signals()
        collect_rarely()
        from graspbench.cli.app import main as run  # takes a while

        run()
    except KeyboardInterrupt:
        print("graspbench: interrupted.", file=sys.stderr)
        sys.exit(130)
