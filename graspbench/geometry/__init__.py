"""Objects: shapes, mesh files, their preflight, repair and convex pieces."""

from graspbench.geometry.catalogue import CatalogueEntry, catalogue_entry, list_objects
from graspbench.geometry.files import load_mesh
from graspbench.geometry.folders import FolderItem, list_folder
from graspbench.geometry.inspection import MeshProblem, MeshReport
from graspbench.geometry.model import ObjectModel
from graspbench.geometry.object_loading import load_object, object_name
from graspbench.geometry.object_parameters import ObjectParameters
from graspbench.geometry.preflight import check_mesh, repair_mesh
from graspbench.geometry.units import Scale

__all__ = [
    "CatalogueEntry",
    "FolderItem",
    "MeshProblem",
    "MeshReport",
    "ObjectModel",
    "ObjectParameters",
    "Scale",
    "catalogue_entry",
    "check_mesh",
    "list_folder",
    "list_objects",
    "load_mesh",
    "load_object",
    "object_name",
    "repair_mesh",
]
