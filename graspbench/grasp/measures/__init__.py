"""The registered measures of grasps."""
