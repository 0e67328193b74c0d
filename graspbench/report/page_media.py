"""Pictures and films of trials for the report's page: carried in it, or linked to.

Only regular files of a trial's own folder are read, none through a link, and none that is larger than a
picture of ours ever is.
"""

import base64
import os
import struct
from collections.abc import Sequence
from heapq import nsmallest
from itertools import islice
from pathlib import Path
from typing import Literal
from urllib.parse import quote

import cv2

from graspbench.quiet import captured_output

Pictures = Literal["auto", "embed", "link", "none"]

EMBEDDED_TRIALS = 40
"""Up to so many trials the page carries their pictures; beyond, it links to the files beside it."""

MAX_MEDIA = 24
"""So many pictures and films of a trial are shown at most; ours are fewer."""

_PICTURE_WIDTH_PX = 900
_PICTURE_QUALITY = 82
_MAX_PICTURE_PIXELS = 40_000_000
_MAX_PICTURE_BYTES = 40_000_000
_MAX_FILM_BYTES = 3_000_000  # carried in the page
_MAX_CARRIED_BYTES = 60_000_000  # by the page in all
_MAX_ENTRIES = 10_000  # of a folder that are looked at
_FILMS = {".mp4": "video/mp4", ".webm": "video/webm"}
_STILLS = (".png", ".gif")

Medium = tuple[str, str, str]
"""Kind ("picture" or "film"), name, and address."""


def trial_media(places: Sequence[Path | None], output_dir: Path, mode: Pictures) -> dict[str, list[Medium]]:
    """Return each trial's pictures and films by its number in ``places``.

    A folder may come from anybody: of each no more than `MAX_MEDIA` are taken, the first by name, none that
    would take a browser gigabytes to show, and what the page carries is bounded; beyond that it links.

    Args:
        places: The trials' folders.
        output_dir: Where the page goes.
        mode: See `graspbench.report.html.write_page`.
    """
    if mode == "none":
        return {}
    found = {
        number: paths
        for number, folder in enumerate(places)
        if folder is not None and (paths := shown_files(folder))
    }
    carried = mode == "embed" or (mode == "auto" and len(found) <= EMBEDDED_TRIALS)
    room = _MAX_CARRIED_BYTES if carried else 0
    media = {}
    for number, paths in found.items():
        shown = []
        for path in paths:
            address = "./" + quote(Path(os.path.relpath(path, output_dir)).as_posix())
            if room > 0 and (path.suffix == ".png" or path.stat().st_size <= _MAX_FILM_BYTES):
                content = _carried(path)
                if content is None:
                    continue
                if len(content) <= room:
                    address = content
                    room -= len(content)
            shown.append(("film" if path.suffix in _FILMS else "picture", path.stem, address))
        media[str(number)] = shown
    return media


def shown_files(folder: Path) -> list[Path]:
    """Return the files of a folder that a page can show."""
    if not folder.is_dir():
        return []
    suffixes = (*_STILLS, *_FILMS)
    with os.scandir(folder) as entries:
        names = nsmallest(
            MAX_MEDIA,
            (
                entry.name
                for entry in islice(entries, _MAX_ENTRIES)
                if entry.name.endswith(suffixes) and entry.is_file(follow_symlinks=False)
            ),
        )
    return [path for path in (folder / name for name in names) if path.suffix in _FILMS or _is_picture(path)]


def _is_picture(path: Path) -> bool:
    """Tell whether a file says that it is a picture of a size that can be shown."""
    with path.open("rb") as stream:
        head = stream.read(24)
    if path.suffix == ".png" and len(head) == 24 and head.startswith(b"\x89PNG\r\n\x1a\n"):
        width, height = struct.unpack(">II", head[16:24])
    elif path.suffix == ".gif" and len(head) == 24 and head.startswith((b"GIF87a", b"GIF89a")):
        width, height = struct.unpack("<HH", head[6:10])
    else:
        return False
    return 0 < width * height <= _MAX_PICTURE_PIXELS and path.stat().st_size <= _MAX_PICTURE_BYTES


def _carried(path: Path) -> str | None:
    """Return a picture or a film as a data address; None of a picture that cannot be decoded."""
    if path.suffix == ".png":
        return _as_jpeg(path)
    return _data(_FILMS.get(path.suffix, "image/gif"), path.read_bytes())


def _as_jpeg(path: Path) -> str | None:
    """Return a picture as a data address, smaller and as JPEG; None of what cannot be decoded."""
    with captured_output():  # the decoder complains of damaged files itself
        image = cv2.imread(str(path))
    if image is None:
        return None
    scale = _PICTURE_WIDTH_PX / image.shape[1]
    if scale < 1:
        size = (_PICTURE_WIDTH_PX, max(1, round(scale * image.shape[0])))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _PICTURE_QUALITY])
    return _data("image/jpeg", data.tobytes())


def _data(kind: str, content: bytes) -> str:
    return f"data:{kind};base64," + base64.b64encode(content).decode("ascii")
