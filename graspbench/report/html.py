"""The report as one HTML page that needs no network: tables, filters, plots, trials in three dimensions.

A results folder may come from anybody. The template engine escapes all text, data stand in elements that no
browser runs, a policy in the page lets nothing run but the page's own script, and trials are addressed by
their place in the table, never by what a file calls them.
"""

import base64
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pandas as pd
from markupsafe import Markup

from graspbench.errors import LogError
from graspbench.report import columns as c
from graspbench.report.geometry import GEOMETRY_FILE, read_geometry
from graspbench.report.heads import head_of
from graspbench.report.page_media import Pictures, trial_media
from graspbench.report.tables import Table
from graspbench.results.store import write_atomically

__all__ = ["Pictures", "write_page"]

_PAGE = Path(__file__).parent / "page"
_SCRIPTS = ("statistics.js", "plots.js", "viewer.js", "app.js")
_GEOMETRY_BUDGET_BYTES = 80_000_000
_AGAIN_MS = 5_000  # how often the page of a study that is running is loaded again

# Offered in the table, as filters and as groups when the trials differ in them.
_SHOWN = (
    c.TRIAL_ID, c.STATUS, c.OBJECT, c.HAND, c.FINGERS, c.INDEX, c.GAIN, c.SEED, c.SUCCESS, *c.QUALITIES,
    c.PLANNING_TIME, "provenance.seconds", c.REASON,
)  # fmt: skip
_FILTERS = (c.STATUS, c.SUCCESS)
_GROUPS = (c.OBJECT, c.INDEX, c.HAND, c.FINGERS, c.GAIN, c.STATUS)
_STRIPS = ("ratio.q1", "local.q1", c.PLANNING_TIME)
_SCATTER_X = ("local.q1", "local.q3", "ratio.q1")
_SCATTER_Y = ("execution.phases.lift.slip_m", "ratio.q1", c.PLANNING_TIME, c.SEED)
_MAX_FILTER_VALUES = 60


def write_page(
    trials: pd.DataFrame,
    output_dir: Path,
    folders: Mapping[str, Path],
    *,
    title: str = "Trials",
    pictures: Pictures = "auto",
    tables: Sequence[Table] = (),
    running: str | None = None,
) -> Path:
    """Write ``index.html``.

    Args:
        trials: One row a trial, dotted column names as in ``trials.csv``.
        output_dir: Where it goes; made if need be.
        folders: Each trial's folder by its id; pictures and geometry are looked for there.
        title: Heading of the page.
        pictures: Whether pictures are carried in the page or linked to by relative paths; "auto" carries
            those of up to `graspbench.report.page_media.EMBEDDED_TRIALS` trials.
        tables: What stands first, before filters and plots.
        running: How far the study is that is still running: the page says it and loads itself again now and
            then; None for one that is over.

    Raises:
        LogError: There are no trials.
    """
    if trials.empty:
        raise LogError("the trials are none", remedy="give a folder that run or sweep has written")
    places = [folders.get(str(trial_id)) for trial_id in trials[c.TRIAL_ID]]
    shared, geometry = _geometry(places)
    data = {**_document(trials), "media": trial_media(places, output_dir, pictures)}
    data |= {"running": running, "againAfterMs": _AGAIN_MS}
    script = "\n".join((_PAGE / name).read_text(encoding="utf-8") for name in _SCRIPTS)
    style = (_PAGE / "page.css").read_text(encoding="utf-8")
    page = _template().render(
        policy=_policy(script, style),
        title=title,
        tables=tables,
        css=Markup(style),
        js=Markup(script),
        data=_script_json(data),
        shared=_script_json(shared),
        geometry=[(number, _script_json(found)) for number, found in geometry],
    )
    path = output_dir / "index.html"
    write_atomically(path, page)
    return path


@cache
def _template() -> jinja2.Template:
    loader = jinja2.FileSystemLoader(_PAGE)
    environment = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    return environment.get_template("page.html")


def _policy(script: str, style: str) -> str:
    """Return what a browser may do with the page: run this script, and show what stands beside it."""
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src '{_hash(script)}'",
            f"style-src '{_hash(style)}'",
            "img-src data: 'self' file:",
            "media-src data: 'self' file:",
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _document(trials: pd.DataFrame) -> dict[str, Any]:
    """Return what differs between trials as columns and rows, and what does not as one list."""
    varying, common = [], {}
    for name in map(str, trials.columns):
        values = trials[name]
        if name in (c.TRIAL_ID, c.STATUS) or values.map(str).nunique() > 1:
            if values.notna().any() and name != c.FOLDER:
                varying.append(name)
        elif not _missing(values.iloc[0]) and name != c.FOLDER:
            common[name] = _plain(values.iloc[0])
    numeric = [name for name in varying if _is_numeric(trials[name])]
    columns = [
        {"name": name, "head": _heading(name), "kind": "number" if name in numeric else "text"}
        for name in varying
    ]
    rows = list(zip(*(_column(trials[name]) for name in varying), strict=True))
    asked = [name for name in c.settings(trials) if name in varying and name != c.SEED]
    few = [name for name in asked if trials[name].map(str).nunique() <= _MAX_FILTER_VALUES]
    return {
        "columns": columns,
        "rows": rows,
        "common": common,
        "commonHeads": {name: _heading(name) for name in common},
        "shown": _once((*_SHOWN, *few), varying, trials),
        "filters": _once((*_FILTERS, *few), varying, trials),
        "groups": _once((*_GROUPS, *few), varying, trials) or [c.STATUS],
        "strips": _offered(_STRIPS, numeric),
        "scatter": [_offered(_SCATTER_X, numeric)[0], _offered(_SCATTER_Y, numeric)[0]],
    }


def _once(names: Iterable[str], varying: Sequence[str], trials: pd.DataFrame) -> list[str]:
    """Return the columns that differ between trials, each heading with the same values once."""
    kept: dict[Any, str] = {}
    for name in names:
        if name in varying:
            kept.setdefault((_heading(name), tuple(trials[name].map(str))), name)
    return list(kept.values())


def _heading(name: str) -> str:
    head, unit = head_of(name)
    return f"{head} [{unit}]" if unit else head


def _offered(wanted: tuple[str, ...], there: list[str]) -> list[str]:
    return [name for name in wanted if name in there] or there[:1] or [c.TRIAL_ID]


def _is_numeric(values: pd.Series) -> bool:
    known = values.dropna()
    return all(isinstance(v, int | float | np.number) and not isinstance(v, bool | np.bool_) for v in known)


def _column(values: pd.Series) -> list[Any]:
    return [_plain(value) for value in values.tolist()]


def _missing(value: Any) -> bool:
    return value is None or value is pd.NA or (isinstance(value, float) and not np.isfinite(value))


def _plain(value: Any) -> Any:
    if _missing(value):
        return None
    if isinstance(value, float):
        return float(f"{value:.6g}")
    value = value.item() if hasattr(value, "item") else value
    return value if isinstance(value, bool | int | str) else str(value)


def _geometry(places: Sequence[Path | None]) -> tuple[dict[str, Any], list[tuple[int, Any]]]:
    """Return the arrays that trials share, and each trial's geometry by its place in the table."""
    shared: dict[str, Any] = {}
    found, size = [], 0
    for number, folder in enumerate(places):
        if folder is None or size > _GEOMETRY_BUDGET_BYTES:
            continue
        path = folder / GEOMETRY_FILE
        geometry = read_geometry(path, shared)
        if geometry is not None:
            size += path.stat().st_size
            found.append((number, geometry))
    return shared, found


def _script_json(value: Any) -> Markup:
    """Return JSON that cannot end the script element it stands in."""
    text = json.dumps(value, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c"))
