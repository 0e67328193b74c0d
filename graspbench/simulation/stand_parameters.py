"""The physics in which grasps are tried on a stand."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field


@dataclass(frozen=True)
class StandParameters:
    """The physics in which grasps are tried."""

    time_step_s: Annotated[float, Field(gt=0, le=0.005, description="Physics time step, s")] = 0.002
    solver_iterations: Annotated[
        int, Field(ge=10, le=1000, description="Constraint solver iterations a step")
    ] = 40
    stiffness_nm_rad: Annotated[
        float, Field(gt=0, description="Stiffness with which joints go to the squeeze, N m/rad")
    ] = 10.0
    damping_nms_rad: Annotated[float, Field(gt=0, description="Damping of the joints, N m s/rad")] = 0.2
    rotor_inertia_kg_m2: Annotated[
        float, Field(ge=0, description="Inertia of a joint's motor behind its gears, kg m^2")
    ] = 1e-3
    torsional_friction_m: Annotated[
        float, Field(ge=0, description="Torque about a contact's normal per normal force, m")
    ] = 0.002
    closing_time_s: Annotated[
        float,
        Field(gt=0, description="Time from the pregrasp to the grasp, and from there to the squeeze, s"),
    ] = 0.25
    settling_time_s: Annotated[float, Field(ge=0, description="Time at the squeeze before a trial, s")] = 0.15
