"""What is said of a file of grasps that cannot be used."""

from graspbench.errors import InputError


class GraspFileError(InputError):
    """A file of grasps cannot be read, or does not fit hand and object."""
