"""The limits of a hierarchical QP as compiled code sees them."""

from typing import Annotated

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import inner
from graspbench.manipulation.compiled.dense import dot
from graspbench.manipulation.compiled.record import Record

FAR = 1e8
"""A bound that is none."""
SLACK = 1e-9
"""How far a limit may be exceeded by rounding, scaled variables."""


class LimitArrays(Record):
    """The limits, and room to work.

    Attributes:
        gain: Share of the way to a limit that may be gone in a second, 1/s.
        margin_m: Added to the least distances.
        lower: Lower joint limits, rad.
        upper: Upper joint limits, rad.
        fastest: Joint velocity limits, rad/s.
        domains: Where the contacts' charts may be used.
        pairs: Fingers to keep apart.
        distances_m: Their least distances.
        low: Lower bounds of x now.
        high: Upper bounds of x now.
        rows: Derivatives of the pairs' distances with respect to x.
        least: Lower bounds of their rates now.
        near: The projected velocity.
        x: The result.
    """

    gain: float
    margin_m: float
    lower: Annotated[FloatArray, "joints"]
    upper: Annotated[FloatArray, "joints"]
    fastest: Annotated[FloatArray, "joints"]
    domains: Annotated[FloatArray, "contacts", 2, 2]
    pairs: Annotated[IntArray, "pairs", 2]
    distances_m: Annotated[FloatArray, "pairs"]
    low: Annotated[FloatArray, "variables"]
    high: Annotated[FloatArray, "variables"]
    rows: Annotated[FloatArray, "pairs", "variables"]
    least: Annotated[FloatArray, "pairs"]
    near: Annotated[FloatArray, "variables"]
    x: Annotated[FloatArray, "variables"]


@inner
def is_admissible(limits: LimitArrays) -> bool:
    """Return whether x meets all limits."""
    x = limits.x
    for v in range(len(x)):
        if x[v] < limits.low[v] - SLACK or x[v] > limits.high[v] + SLACK:
            return False
    closest = 0.0
    for p in range(len(limits.least)):
        closest = min(closest, dot(limits.rows[p], x) - limits.least[p])
    return closest >= -SLACK
