"""Pictures and films of trials for the report's page: carried in it, or linked to.

Only regular files of a trial's own folder are read, none through a link, and none that is larger than a
picture of ours ever is.
"""

import base64
import os
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Literal
from urllib.parse import quote

import cv2

from graspbench.quiet import captured_output

Pictures = Literal["auto", "embed", "link", "none"]

EMBEDDED_TRIALS = 40
"""Up to so many trials the page carries their pictures; beyond, it links to the files beside it."""

_PICTURE_WIDTH_PX = 900
_PICTURE_QUALITY = 82
_MAX_PICTURE_PIXELS = 40_000_000
_MAX_FILM_BYTES = 3_000_000
_FILMS = {".mp4": "video/mp4", ".webm": "video/webm"}
_STILLS = (".png", ".gif")

Medium = tuple[str, str, str]
"""Kind ("picture" or "film"), name, and address."""


def trial_media(places: Sequence[Path | None], output_dir: Path, mode: Pictures) -> dict[str, list[Medium]]:
    """Return each trial's pictures and films by its number in ``places``.

    Args:
        places: The trials' folders.
        output_dir: Where the page goes.
        mode: See `graspbench.report.html.write_page`.
    """
    if mode == "none":
        return {}
    found = {
        number: names
        for number, folder in enumerate(places)
        if folder is not None and (names := _names(folder))
    }
    embed = mode == "embed" or (mode == "auto" and len(found) <= EMBEDDED_TRIALS)
    media = {}
    for number, names in found.items():
        folder = places[number]
        assert folder is not None, "only trials with a folder are found"
        each = [_medium(folder / name, output_dir, embed) for name in names]
        media[str(number)] = [medium for medium in each if medium is not None]
    return media


def _names(folder: Path) -> list[str]:
    """Return the regular files of a folder that a page can show."""
    if not folder.is_dir():
        return []
    suffixes = (*_STILLS, *_FILMS)
    with os.scandir(folder) as entries:
        return sorted(
            entry.name
            for entry in entries
            if entry.name.endswith(suffixes) and entry.is_file(follow_symlinks=False)
        )


def _medium(path: Path, output_dir: Path, embed: bool) -> Medium | None:
    kind = "film" if path.suffix in _FILMS else "picture"
    if embed and path.suffix == ".png":
        address = _embedded(path)
    elif embed and path.stat().st_size <= _MAX_FILM_BYTES:
        address = _data(_FILMS.get(path.suffix, "image/gif"), path.read_bytes())
    else:
        place = Path(os.path.relpath(path.parent, output_dir)).as_posix()
        address = "./" + quote(f"{place}/{path.name}")
    return (kind, path.stem, address) if address is not None else None


def _embedded(path: Path) -> str | None:
    """Return a picture as a data address, smaller and as JPEG; None of what is no picture."""
    with path.open("rb") as stream:
        head = stream.read(24)
    if len(head) < 24 or not head.startswith(b"\x89PNG\r\n\x1a\n"):
        return None
    width, height = struct.unpack(">II", head[16:24])
    if not 0 < width * height <= _MAX_PICTURE_PIXELS:
        return None
    with captured_output():  # the decoder complains of damaged files itself
        image = cv2.imread(str(path))
    if image is None:
        return None
    scale = _PICTURE_WIDTH_PX / image.shape[1]
    if scale < 1:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _PICTURE_QUALITY])
    return _data("image/jpeg", data.tobytes())


def _data(kind: str, content: bytes) -> str:
    return f"data:{kind};base64," + base64.b64encode(content).decode("ascii")
