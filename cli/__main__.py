"""``python -m graspbench.cli``."""

from graspbench.cli.app import main

main()
