"""Graspbench cli."""
