"""Objects: shapes, mesh files, their preflight, repair and convex pieces."""

from graspbench.geometry.catalogue import (
    CatalogueEntry,
    ObjectParameters,
    catalogue_entry,
    list_objects,
    load_object,
)
from graspbench.geometry.files import load_mesh
from graspbench.geometry.inspection import MeshProblem, MeshReport, check_mesh
from graspbench.geometry.model import ObjectModel

__all__ = [
    "CatalogueEntry",
    "MeshProblem",
    "MeshReport",
    "ObjectModel",
    "ObjectParameters",
    "catalogue_entry",
    "check_mesh",
    "list_objects",
    "load_mesh",
    "load_object",
]
