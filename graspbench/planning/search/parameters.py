"""What the global search is asked for, and its limits."""

from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias, get_args

from pydantic import Field

from graspbench.errors import ConfigurationError
from graspbench.planning.parameters import PHI_CEI_DEG, PHI_EEGI_DEG, PhiCeiDeg, PhiEegiDeg

GlobalMeasure: TypeAlias = Literal["q1", "q2", "q3", "mirtich_canny"]

GLOBAL_MEASURES: tuple[GlobalMeasure, ...] = get_args(GlobalMeasure)
"""Measures that can be searched for."""


@dataclass(frozen=True)
class SearchParameters:
    """Limits of the global search."""

    enabled: Annotated[bool, Field(description="Search for the global optimum too")] = True
    measures: Annotated[
        tuple[GlobalMeasure, ...],
        Field(description="Measures whose optimum is searched; mirtich_canny is for 3 fingers"),
    ] = ("q1", "q2", "q3")
    refine: Annotated[
        bool, Field(description="Climb q1, q2 and q3 from the local grasp too (quality ascent)")
    ] = False
    time_limit_s: Annotated[float, Field(gt=0, le=86_400, description="Time limit per measure, s")] = 30.0
    gap: Annotated[float, Field(ge=0, lt=1, description="Relative gap at which the search may stop")] = 0.0
    threads: Annotated[int, Field(ge=0, le=64, description="Threads; 0: as many as there are cores")] = 0
    climbs: Annotated[
        int, Field(ge=0, le=64, description="Climbs from sampled grasps, for a first one to beat")
    ] = 4
    centre_tolerance_m: Annotated[
        float,
        Field(gt=0, description="Distance of the centre of grip from the centroid allowed when k_cm > 0, m"),
    ] = 0.01
    phi_cei_deg: Annotated[
        PhiCeiDeg | None,
        Field(description="Largest coplanarity error, deg; null: index.phi_cei_deg, or else 15"),
    ] = None
    phi_eegi_deg: Annotated[
        PhiEegiDeg | None,
        Field(description="Largest equilateral error, deg; null: index.phi_eegi_deg, or else 10"),
    ] = None

    @property
    def thresholds_deg(self) -> tuple[float, float]:
        """Largest coplanarity and equilateral errors of ``mirtich_canny``."""
        cei, eegi = self.phi_cei_deg, self.phi_eegi_deg
        return PHI_CEI_DEG if cei is None else cei, PHI_EEGI_DEG if eegi is None else eegi


def check_measure(measure: str, n_f: int) -> None:
    """Refuse a measure that cannot be searched for.

    Raises:
        ConfigurationError: The measure is unknown, or the number of contacts is not supported.
    """
    if measure not in GLOBAL_MEASURES:
        raise ConfigurationError(
            f"unknown measure '{measure}' for the global search",
            remedy=f"choose from {', '.join(GLOBAL_MEASURES)}",
        )
    if not 2 <= n_f <= 5:
        raise ConfigurationError(f"global search for {n_f} contacts", remedy="choose 2 to 5")
    if measure == "mirtich_canny" and n_f != 3:
        raise ConfigurationError(
            f"the Mirtich-Canny criterion for {n_f} contacts", remedy="it is defined for 3 fingers"
        )
