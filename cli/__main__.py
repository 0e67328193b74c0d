"""``python -m graspbench.cli``."""

from graspbench.cli.start import main

main()
