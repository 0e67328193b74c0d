"""Graspbench datasets."""
