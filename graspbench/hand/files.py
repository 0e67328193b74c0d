"""Where hand descriptions are found: installed YAML files, URDF files and their packages."""

import hashlib
import importlib.metadata
import importlib.util
import os
import tempfile
from functools import lru_cache
from importlib import resources
from pathlib import Path

from graspbench.cache import user_cache
from graspbench.errors import HandError

SCHEME = "package://"
_PACKAGE_DEPTH = 5
_MAX_LINE = 8000


def list_hands() -> tuple[str, ...]:
    """Return the names of the installed hands (the options of the configuration group ``hand``)."""
    folder = resources.files("graspbench.conf") / "hand"
    return tuple(sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".yaml")))


def find_urdf(urdf: str | None, package_dirs: tuple[str, ...], hand: str) -> tuple[Path, tuple[Path, ...]]:
    """Find a hand's URDF and the folders its ``package://`` references start from.

    Args:
        urdf: A path, or ``package://PACKAGE/PATH``.
        package_dirs: Folders given by the user, searched first.
        hand: Name of the hand, for error messages.

    Raises:
        HandError: Nothing is given, or there is no such file.
    """
    if not urdf:
        raise HandError(f"hand '{hand}' has no URDF", remedy="set hand.urdf, or hand.kind=radial")
    folders = tuple(Path(d).expanduser().resolve() for d in package_dirs)
    for folder in folders:
        if not folder.is_dir():
            raise HandError(
                f"package folder '{folder}' of hand '{hand}' does not exist",
                remedy="correct hand.package_dirs",
                path=str(folder),
            )
    if urdf.startswith(SCHEME):
        relative = urdf.removeprefix(SCHEME)
        folders += tuple(f for f in (_installed_share(relative),) if f is not None)
        candidates = [folder / relative for folder in folders]
    else:
        candidates = [Path(urdf).expanduser().resolve()]
    for candidate in candidates:
        if candidate.is_file():
            # A package is a folder around its URDF, as ROS lays it out: PACKAGE/urdf beside PACKAGE/meshes.
            return candidate, folders + tuple(candidate.parents)[:_PACKAGE_DEPTH]
    raise HandError(
        f"the URDF '{urdf}' of hand '{hand}' does not exist",
        remedy="correct hand.urdf"
        + (
            ", add its folder to hand.package_dirs, or install its package" if urdf.startswith(SCHEME) else ""
        ),
        path=urdf,
    )


def in_short_lines(text: str) -> str:
    """Return XML whose lines PyBullet reads whole: it reads 8191 letters at a time and breaks names in two.

    Text whose lines are short enough is returned as it is.
    """
    if all(len(line) <= _MAX_LINE for line in text.split("\n")):
        return text
    return text.replace("><", ">\n<")


def write_urdf(text: str, stem: str, folder: Path | None = None) -> Path:
    """Write a URDF to a file named after its content.

    Args:
        text: The URDF; it is written with lines that PyBullet reads whole.
        stem: First part of the file's name.
        folder: Where to write; the user's cache folder by default.

    Returns:
        Path of the file; the same content gives the same path, so that runs can share it.

    Raises:
        HandError: The file cannot be written.
    """
    text = in_short_lines(text)
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    target = folder or user_cache("hands")
    path = target / f"{stem}_{digest}.urdf"
    try:
        if path.is_file() and path.read_text() == text:
            return path
        target.mkdir(parents=True, exist_ok=True)
        # Written aside and renamed: another process must never read half a file.
        handle, partial = tempfile.mkstemp(dir=target, suffix=".partial")
        with os.fdopen(handle, "w") as stream:
            stream.write(text)
        os.replace(partial, path)
    except OSError as error:
        raise HandError(
            f"the hand's URDF cannot be written to '{target}' ({error.strerror})",
            remedy="make the folder writable or set XDG_CACHE_HOME",
            path=str(path),
        ) from error
    return path


@lru_cache
def _installed_share(relative: str) -> Path | None:
    """Return the folder that holds ``PACKAGE/PATH``: PACKAGE is a distribution, or a package of Python."""
    package = relative.split("/", 1)[0]
    try:
        files = importlib.metadata.files(package) or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    for file in files:
        if str(file).endswith("/" + relative):
            located = Path(str(file.locate())).resolve()
            return located.parents[len(Path(relative).parts) - 1]
    return _python_package_parent(package)


def _python_package_parent(package: str) -> Path | None:
    try:
        found = importlib.util.find_spec(package) if package.isidentifier() else None
    except (ImportError, ValueError):
        return None
    places = None if found is None else found.submodule_search_locations
    return Path(next(iter(places))).resolve().parent if places else None
