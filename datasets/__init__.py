"""Graspbench datasets: the catalogue of objects, one YAML file each, and the masses of the YCB set."""

from pathlib import Path

CATALOGUE_DIR = Path(__file__).parent / "catalogue"
YCB_FILE = Path(__file__).parent / "ycb.yaml"


def catalogue_files() -> dict[str, Path]:
    """Return the file of each object of the catalogue by name, sorted; nothing else lists them."""
    return {path.stem: path for path in sorted(CATALOGUE_DIR.glob("*.yaml"))}
