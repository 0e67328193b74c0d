"""Graspbench conf."""
