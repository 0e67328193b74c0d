"""The study of what grasp quality measures are worth: grasps, measures, what they withstood, statistics."""
