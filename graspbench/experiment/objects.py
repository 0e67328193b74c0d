"""What is known of an object, and whether a mesh can be one."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from graspbench.config.trial_config import load_config
from graspbench.errors import MeshError
from graspbench.geometry import MeshReport, ObjectModel, Scale, check_mesh, load_object, repair_mesh
from graspbench.results.store import write_atomically


def show_object(
    overrides: Sequence[str], folder: Path, config_dir: Path | None = None
) -> tuple[dict[str, Any], Path]:
    """Describe the object of a configuration and draw it.

    Args:
        overrides: The object in Hydra's grammar, such as ``object=random`` and ``object.id=137``.
        folder: Where the picture goes.
        config_dir: A folder with further configuration groups and options.

    Returns:
        Its properties, and the picture's path.

    Raises:
        ConfigurationError: There is no such object or option.
        MeshError: The mesh cannot be used.
    """
    from graspbench.report.object_picture import draw_object  # loads Matplotlib

    model = load_object(load_config(["record=off", *overrides], config_dir).object)
    folder.mkdir(parents=True, exist_ok=True)
    return describe_model(model), draw_object(model, folder / f"{model.name.replace('/', '_')}.png")


def describe_model(model: ObjectModel) -> dict[str, Any]:
    """Return what is known of an object: size, mass, inertia, topology, pieces, licence, repairs."""
    report = model.report
    return {
        "name": model.name,
        "extents_mm": [1e3 * float(length) for length in model.extents_m],
        "mass_kg": model.mass_kg,
        "inertia_kg_m2": model.inertia.tolist(),
        "friction": model.friction,
        "triangles": len(model.mesh.faces),
        "watertight": bool(model.mesh.is_watertight),
        "genus": (2 - int(model.mesh.euler_number)) // 2,
        "volume_cm3": 1e6 * float(model.mesh.volume),
        "collision_pieces": len(model.collision_parts),
        "licence": model.licence,
        "source": model.source,
        "repairs": [] if report is None else list(report.repairs),
        "warnings": [] if report is None else list(report.warnings),
    }


def check_object(path: Path, scale: Scale) -> dict[str, Any]:
    """Say in one sentence whether and how a mesh file can be an object, and what was found.

    What can be repaired is repaired for trial, nothing is written.

    Args:
        path: The file.
        scale: Metres per unit of the file, or "guess".
    """
    report = check_mesh(path, scale=scale)
    if report.usable:
        done = f": {'; '.join(report.repairs)}" if report.repairs else " as it is"
        return _described(path, report, f"{report.name} can be used{done}.", False)
    first = report.problems[0]
    if not any(problem.repairable for problem in report.problems):
        return _described(path, report, str(first), False)
    try:
        repaired = repair_mesh(path, scale=scale)[1]
    except MeshError as error:
        return _described(path, report, str(error), False)
    done = "; ".join((*repaired.repairs, *repaired.warnings))
    sentence = f"{first.what}, but object.repair=true makes it usable: {done}."
    return _described(path, report, sentence, True)


def repair_object(path: Path, scale: Scale, repaired: Path) -> dict[str, Any]:
    """Write a usable copy of a mesh file, in metres, if there can be one, and say what was changed.

    Args:
        path: The file.
        scale: Metres per unit of the file, or "guess".
        repaired: File to write; its suffix says the format.

    Raises:
        MeshError: The format cannot be written, or the mesh cannot be repaired.
    """
    if repaired.suffix.lower() not in (".stl", ".obj", ".ply", ".off", ".glb"):
        raise MeshError(
            f"'{repaired}' has no format that can be written",
            remedy="end it with .stl, .obj, .ply, .off or .glb",
        )
    mesh, report = repair_mesh(path, scale=scale)
    content = mesh.export(file_type=repaired.suffix.lower()[1:])
    write_atomically(repaired, content)
    done = "; ".join(report.repairs) or "nothing had to be changed"
    verdict = f"a usable copy of {report.name} was written: {done}."
    return _described(path, report, verdict, False) | {"repaired_copy": str(repaired)}


def _described(path: Path, report: MeshReport, verdict: str, by_repair: bool) -> dict[str, Any]:
    measured = {
        "triangles": report.triangles,
        "bodies": report.bodies,
        "watertight": report.watertight,
        "genus": report.genus,
        "extents_mm": [1e3 * length for length in report.extents_m],
        "volume_cm3": None if report.volume_m3 is None else 1e6 * report.volume_m3,
    }
    return {
        "file": str(path),
        "verdict": verdict,
        "usable": report.usable,
        "usable_after_repair": report.usable or by_repair,
        "problems": [
            {"kind": found.kind, "sentence": str(found), "repairable": found.repairable}
            for found in report.problems
        ],
        "repairs": list(report.repairs),
        "warnings": list(report.warnings),
        **(measured if report.triangles else {}),
    }
