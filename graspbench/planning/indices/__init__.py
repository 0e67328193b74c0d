"""The grasp quality indices that come with Graspbench, one module each."""
