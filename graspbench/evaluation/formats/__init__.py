"""Files of grasps: one module a format."""
