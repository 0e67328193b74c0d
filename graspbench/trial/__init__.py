"""Trials: from images to an executed grasp, or to an object moved in the hand; run and stored."""
