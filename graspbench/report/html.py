"""The report as one HTML page that needs no network: table, filters, plots, trials in three dimensions."""

import base64
import json
import os
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import pandas as pd

from graspbench.errors import LogError
from graspbench.report.geometry import GEOMETRY_FILE, read_geometry

Pictures = Literal["auto", "embed", "link", "none"]

_PAGE = Path(__file__).parent / "page"
_SCRIPTS = ("statistics.js", "plots.js", "viewer.js", "app.js")

# Up to so many trials the page carries their pictures; beyond, it links to the files beside it.
EMBEDDED_TRIALS = 40
_PICTURE_WIDTH_PX = 900
_PICTURE_QUALITY = 82
_GEOMETRY_BUDGET_BYTES = 80_000_000

# Offered in the table, as filters and as groups when the trials differ in them.
_SHOWN = (
    "trial_id", "status", "object.name", "hand.name", "hand.fingers", "index.name", "index.k_cm", "seed",
    "success", "local.q1", "local.q2", "local.q3", "ratio.q1", "ratio.q2", "ratio.q3", "local.time_s",
    "provenance.seconds", "reason",
)  # fmt: skip
_FILTERS = ("status", "success", "object.name", "hand.name", "hand.fingers", "index.name", "index.k_cm")
_GROUPS = ("object.name", "index.name", "hand.name", "hand.fingers", "index.k_cm", "status")
_STRIPS = ("ratio.q1", "local.q1", "local.time_s")
_SCATTER_X = ("local.q1", "local.q3", "ratio.q1")
_SCATTER_Y = ("execution.phases.lift.slip_m", "ratio.q1", "local.time_s", "seed")


def write_page(
    trials: pd.DataFrame,
    output_dir: Path,
    folders: Mapping[str, Path],
    *,
    title: str = "Trials",
    pictures: Pictures = "auto",
) -> Path:
    """Write ``index.html``.

    Args:
        trials: One row a trial, dotted column names as in ``trials.csv``.
        output_dir: Where it goes; made if need be.
        folders: Each trial's folder by its id; pictures and geometry are looked for there.
        title: Heading of the page.
        pictures: Whether pictures are carried in the page or linked to by relative paths; "auto" carries
            those of up to `EMBEDDED_TRIALS` trials.

    Raises:
        LogError: There are no trials.
    """
    if trials.empty:
        raise LogError("the trials are none", remedy="give a folder that run or sweep has written")
    output_dir.mkdir(parents=True, exist_ok=True)
    shared, geometry = _geometry(folders)
    data = {**_document(trials), "pictures": _pictures(folders, output_dir, pictures)}
    parts = {
        "title": escape(title),
        "css": (_PAGE / "page.css").read_text(encoding="utf-8"),
        "js": "\n".join((_PAGE / name).read_text(encoding="utf-8") for name in _SCRIPTS),
        "data": _script_json(data),
        "shared": _script_json(shared),
        "geometry": "\n".join(geometry),
    }
    page = (_PAGE / "page.html").read_text(encoding="utf-8")
    for name, text in parts.items():
        page = page.replace("{{" + name + "}}", text, 1 if name != "title" else 2)
    path = output_dir / "index.html"
    temporary = output_dir / f".index.{os.getpid()}.tmp"
    temporary.write_text(page, encoding="utf-8")
    temporary.replace(path)
    return path


def _document(trials: pd.DataFrame) -> dict[str, Any]:
    """Return what differs between trials as columns and rows, and what does not as one list."""
    varying, common = [], {}
    for name in trials.columns:
        values = trials[name]
        if name in ("trial_id", "status") or values.nunique(dropna=False) > 1:
            if values.notna().any() and name != "folder":
                varying.append(str(name))
        elif len(trials) and not pd.isna(values.iloc[0]):
            common[str(name)] = _plain(values.iloc[0])
    numeric = [name for name in varying if _is_numeric(trials[name])]
    columns = [{"name": name, "kind": "number" if name in numeric else "text"} for name in varying]
    rows = list(zip(*(_column(trials[name]) for name in varying), strict=True))
    return {
        "columns": columns,
        "rows": rows,
        "common": common,
        "shown": [name for name in _SHOWN if name in varying],
        "filters": [name for name in _FILTERS if name in varying],
        "groups": [name for name in _GROUPS if name in varying] or ["status"],
        "strips": _offered(_STRIPS, numeric),
        "scatter": [_offered(_SCATTER_X, numeric)[0], _offered(_SCATTER_Y, numeric)[0]],
    }


def _offered(wanted: tuple[str, ...], there: list[str]) -> list[str]:
    return [name for name in wanted if name in there] or there[:1] or ["trial_id"]


def _is_numeric(values: pd.Series) -> bool:
    known = values.dropna()
    return all(isinstance(v, int | float | np.number) and not isinstance(v, bool | np.bool_) for v in known)


def _column(values: pd.Series) -> list[Any]:
    return [_plain(value) for value in values.tolist()]


def _plain(value: Any) -> Any:
    if value is None or value is pd.NA or (isinstance(value, float) and not np.isfinite(value)):
        return None
    if isinstance(value, float):
        return float(f"{value:.6g}")
    return value.item() if hasattr(value, "item") else value


def _geometry(folders: Mapping[str, Path]) -> tuple[dict[str, Any], list[str]]:
    """Return the arrays that trials share, and one script element a trial."""
    shared: dict[str, Any] = {}
    elements, size = [], 0
    for trial_id, folder in folders.items():
        path = folder / GEOMETRY_FILE
        if size > _GEOMETRY_BUDGET_BYTES or not path.is_file():
            continue
        content = read_geometry(path, shared).replace("<", "\\u003c")
        size += len(content)
        elements.append(f'<script type="application/json" id="geometry-{trial_id}">{content}</script>')
    return shared, elements


def _pictures(
    folders: Mapping[str, Path], output_dir: Path, mode: Pictures
) -> dict[str, list[tuple[str, str]]]:
    """Return (name, address) of each trial's pictures."""
    if mode == "none":
        return {}
    found = {
        trial_id: (folder, names)
        for trial_id, folder in folders.items()
        if (names := sorted(name for name in os.listdir(folder) if name.endswith(".png")))
    }
    if mode == "embed" or (mode == "auto" and len(found) <= EMBEDDED_TRIALS):
        return {
            trial_id: [(name.removesuffix(".png"), _embedded(folder / name)) for name in names]
            for trial_id, (folder, names) in found.items()
        }
    addresses = {}
    for trial_id, (folder, names) in found.items():
        place = Path(os.path.relpath(folder, output_dir)).as_posix()
        addresses[trial_id] = [(name.removesuffix(".png"), f"{place}/{name}") for name in names]
    return addresses


def _embedded(path: Path) -> str:
    """Return a picture as a data address, smaller and as JPEG."""
    image = cv2.imread(str(path))
    if image is None:
        return ""
    scale = _PICTURE_WIDTH_PX / image.shape[1]
    if scale < 1:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _PICTURE_QUALITY])
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode("ascii")


def _script_json(value: Any) -> str:
    """Return JSON that cannot end the script element it stands in."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")
