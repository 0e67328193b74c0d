"""Columns' headings as a reader knows them."""

from graspbench.report import columns as c

_UNITS = {
    "_nms_rad": "N m s/rad", "_nm_rad": "N m/rad", "_m_s": "m/s", "_s": "s", "_ms": "ms", "_mm": "mm",
    "_m": "m",    "_deg": "deg", "_kg": "kg", "_rad": "rad", "_n": "N", "_cm2": "cm²", "_weight": "weights",
}  # fmt: skip

_KNOWN = {
    c.OBJECT: ("object", ""),
    c.HAND: ("hand", ""),
    c.FINGERS: ("fingers", ""),
    c.INDEX: ("index", ""),
    c.GAIN: ("k_cm", ""),
    c.PLANNING_TIME: ("planning time", "s"),
    "local.planning_time_s": ("planner's own time", "s"),
    "local.reconstruction_time_s": ("reconstruction time", "s"),
    "local.score": ("index of the local grasp", ""),
    "execution.largest_push_weight": ("push resisted", "weights"),
    "execution.object_displacement_m": ("moved while closing", "m"),
    "execution.object_turn_deg": ("turned while closing", "deg"),
    "reconstruction.mesh_mean_mm": ("mean surface error", "mm"),
    "reconstruction.mesh_max_mm": ("largest surface error", "mm"),
    "provenance.seconds": ("trial's time", "s"),
    "provenance.graspbench": ("version", ""),
    "provenance.git.commit": ("commit", ""),
    "trial_id": ("trial", ""),
}

_SMALLER_IS_BETTER = (
    "time", "error", "slip", "drift", "turn", "displacement", "mesh_", "seconds", "iterations", ".gap",
    "contacts_lost", "violations",
)  # fmt: skip


def head_of(name: str) -> tuple[str, str]:
    """Return a column's heading and unit: ``ratio.q1`` is Q1 local / global."""
    if name in _KNOWN:
        return _KNOWN[name]
    column, unit = _without_unit(name)
    parts = column.split(".")
    first, last = parts[0], parts[-1]
    if last in c.MEASURES and len(parts) == 2:
        return (f"{last.upper()} local / global" if first == "ratio" else f"{last.upper()} {first}"), unit
    if len(parts) == 3 and parts[1] in c.MEASURES:
        words = {"value": ""}.get(last, last)
        return f"{parts[1].upper()} {first} {words}".strip().replace("_", " "), unit
    if name.startswith("execution.phases.") and len(parts) == 4:
        return f"{last} in {parts[2]}".replace("_", " "), unit
    if first == "choice":
        return last.replace("_", " "), unit
    if first == "times_s":
        return f"time of {last}".replace("_", " "), "s"
    return " ".join(parts if c.is_setting(name) else parts[1:] or parts).replace("_", " "), unit


def smaller_is_better(name: str) -> bool:
    """Tell whether less of a column is better: times, errors, slip."""
    return any(word in name for word in _SMALLER_IS_BETTER)


def _without_unit(name: str) -> tuple[str, str]:
    for suffix, unit in _UNITS.items():
        if name.endswith(suffix):
            return name.removesuffix(suffix), unit
    return name, ""
