"""The thesis' elastic surface, under its name in the configuration."""

from graspbench.reconstruction.elastic import reconstruct_elastic
from graspbench.reconstruction.methods import METHODS

METHODS.register("elastic")(reconstruct_elastic)
