"""The sentences by which mesh files are refused, whatever their format."""

from pathlib import Path

from graspbench.errors import MeshError

MAX_FILE_BYTES = 400_000_000
MAX_TRIANGLES = 3_000_000
"""More than any scan of a graspable object needs; reading stays below 2 GB of memory."""

MAX_VERTICES = 3 * MAX_TRIANGLES


def broken(file: Path, suffix: str, why: str = "it is cut off or broken") -> MeshError:
    """Return the error of a file that does not keep to its format."""
    return MeshError(
        f"{file.name} cannot be read as .{suffix} ({why})",
        remedy="copy or export it again",
        kind="broken",
        path=str(file),
    )


def too_large(file: Path, what: str) -> MeshError:
    """Return the error of a file that holds, or only announces, more than is read."""
    return MeshError(
        f"{file.name} has {what}",
        remedy="simplify the mesh before, or copy it again if it is not so large",
        kind="too_large",
        path=str(file),
    )


def announced(file: Path, count: int, limit: int = MAX_VERTICES) -> MeshError:
    """Return the error of a header that announces more than is read."""
    return MeshError(
        f"{file.name} announces an array of {count}, more than the {limit} that are read",
        remedy="simplify the mesh before, or copy it again if it is not so large",
        kind="too_large",
        path=str(file),
    )


def too_many_triangles(file: Path, count: int) -> MeshError:
    """Return the error of a mesh that is too fine."""
    return too_large(file, f"{count} triangles, more than the {MAX_TRIANGLES} that are read")


def shortened(words: list[str]) -> str:
    """Return words as a sentence may quote them."""
    text = "".join(c if c.isprintable() else "?" for c in " ".join(word[:60] for word in words[:20]))
    return text if len(text) <= 40 else f"{text[:37]}..."
