"""Graspbench."""
