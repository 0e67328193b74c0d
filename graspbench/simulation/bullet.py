"""PyBullet, imported without the line that it prints; the rest of the package takes it from here."""

from graspbench.quiet import captured_output

with captured_output():
    import pybullet

__all__ = ["pybullet"]
