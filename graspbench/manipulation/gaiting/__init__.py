"""Finger gaiting: the fingers turn an object by steps, farther than one grasp allows."""
