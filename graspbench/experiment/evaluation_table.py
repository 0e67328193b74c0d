"""The table of an evaluation: successes by protocol with intervals."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from graspbench.config.protocols import EvaluationParameters
from graspbench.evaluation.table import bootstrap_interval
from graspbench.experiment.evaluation_work import MAX_DEPTH_M
from graspbench.report.statistics import wilson_interval


def protocol_table(
    rows: Sequence[Mapping[str, Any]], parameters: EvaluationParameters
) -> list[dict[str, Any]]:
    """Return successes by protocol with Wilson's interval, and mean values with the bootstrap's."""
    table = [
        _counted(
            "force_closure",
            "the closed hand's contacts resist any wrench",
            [bool(r["force_closure"]) for r in rows],
        ),
        _counted(
            "sound",
            f"joints within limits, no links overlap, at most {1e3 * MAX_DEPTH_M:g} mm in the object",
            [bool(row["sound"]) for row in rows],
        ),
    ]
    for name, protocol in parameters.protocols.items():
        outcomes = [row["protocols"][name] for row in rows if name in row["protocols"]]
        row = _counted(name, protocol.description, [bool(each["success"]) for each in outcomes])
        values = np.array([each["value"] for each in outcomes], dtype=np.float64)
        low, high = bootstrap_interval(values)
        mean = float(values.mean()) if len(values) else float("nan")
        row |= {"value": mean, "value_low": low, "value_high": high, "unit": protocol.unit}
        table.append(row)
    return table


def _counted(name: str, meaning: str, successes: Sequence[bool]) -> dict[str, Any]:
    rate = wilson_interval(sum(successes), len(successes))
    return {
        "protocol": name,
        "success": rate.value,
        "low": rate.low,
        "high": rate.high,
        "grasps": len(successes),
        "meaning": meaning,
    }
