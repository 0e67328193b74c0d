"""Simple objects for the scene."""

import trimesh

from graspbench.geometry.model import ObjectModel


def model_of(mesh, rgba=(0.8, 0.3, 0.2, 1.0), parts=None):
    """Wrap a mesh about its centre of mass as an object of 0.2 kg."""
    mesh.apply_translation(-mesh.center_mass)
    return ObjectModel("sample", mesh, parts or (mesh.convex_hull,), 0.2, 0.6, rgba)


def box():
    """A box of 60 x 40 x 100 mm."""
    return model_of(trimesh.creation.box((0.06, 0.04, 0.1)))


def capsule():
    """An upright capsule, 120 mm high."""
    return model_of(trimesh.creation.capsule(0.06, 0.03, count=(24, 24)))


def cone():
    """A cone, whose centre of mass is far from its middle."""
    return model_of(trimesh.creation.cone(0.04, 0.1))
