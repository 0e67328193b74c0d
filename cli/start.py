"""Where the program begins: signals are heard before anything else is loaded."""

import sys

from graspbench.cli.ending import end_on_signals
from graspbench.loading import leave_quickly, load_quickly


def main() -> None:
    """Run the command line; a signal that comes while it is being loaded ends it like any other."""
    try:
        end_on_signals()
        load_quickly()
        from graspbench.cli.app import main as run  # takes a while

        run()
    except KeyboardInterrupt:
        print("graspbench: interrupted.", file=sys.stderr)
        sys.exit(130)
    finally:
        leave_quickly()
