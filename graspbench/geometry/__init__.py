"""Objects: shapes, mesh files, their preflight, repair and convex pieces."""

from typing import TYPE_CHECKING

from graspbench.lazy import loads_on_use

if TYPE_CHECKING:
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

_HOMES = {
    "CatalogueEntry": "catalogue",
    "FolderItem": "folders",
    "MeshProblem": "inspection",
    "MeshReport": "inspection",
    "ObjectModel": "model",
    "ObjectParameters": "object_parameters",
    "Scale": "units",
    "catalogue_entry": "catalogue",
    "check_mesh": "preflight",
    "list_folder": "folders",
    "list_objects": "catalogue",
    "load_mesh": "files",
    "load_object": "object_loading",
    "object_name": "object_loading",
    "repair_mesh": "preflight",
}

__getattr__ = loads_on_use(__name__, _HOMES)
