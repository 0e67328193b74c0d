"""Shapes described by a few numbers, one kind a module; a new kind is a new file."""

from graspbench.geometry.shapes.registry import SHAPES, Shape, make_shape, register

__all__ = ["SHAPES", "Shape", "make_shape", "register"]
