"""Hands from their published files: palm, fingers, tips and an opposing posture found by geometry."""
