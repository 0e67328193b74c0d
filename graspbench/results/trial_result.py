"""The result of a trial, typed to its leaves: what ``result.json`` holds and every table is made of.

JSON, columns, their dictionary and the migration of older files all derive from these dataclasses; a new
field is written here once.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from graspbench.results.about import About, Number, Part
from graspbench.results.grasp_results import (
    ExploredResult,
    GlobalGraspResult,
    LocalResult,
    PlannedResult,
    RefinedGraspResult,
    RestartedResult,
    StrengthenedResult,
)
from graspbench.results.physical_results import (
    ExecutedResult,
    GaitFigures,
    ManipulationSummary,
    MovingResult,
    PlayedResult,
    SlidingFigures,
)

Status = Literal["done", "failed", "timeout", "crashed", "unreadable"]
Kind = Literal["trial", "manipulation"]

_NOT_EXECUTED = "nothing was executed, or it was not asked for"
_NOT_PLANNED = "the trial came to no grasp"
_OLDER = "the result is of an older version"
_NOT_SIMULATED = "the images came from files, or the trial did not come so far"


@dataclass(frozen=True)
class ObjectResult(Part):
    """The object."""

    name: Annotated[str, About("What the object is called")]
    mass_kg: Annotated[Number | None, About("Its mass", empty=_NOT_SIMULATED)] = None
    extents_m: Annotated[tuple[Number, ...] | None, About("Its size", empty=_NOT_SIMULATED)] = None


@dataclass(frozen=True)
class HandResult(Part):
    """The hand."""

    name: Annotated[str, About("What the hand is called")]
    fingers: Annotated[int, About("Fingers used")]


@dataclass(frozen=True)
class ReconstructionResult(Part):
    """How far the surface came."""

    nodes: Annotated[int, About("Nodes of the surface")]
    snapshots: Annotated[int, About("Surfaces that the planner saw")]
    iterations: Annotated[int, About("Steps of the reconstruction")]
    genus: Annotated[
        int | None, About("Handles of the surface: holes that lead through it", empty="an older result")
    ] = None
    mesh_mean_mm: Annotated[
        Number | None, About("Mean distance of the nodes to the object itself", empty=_NOT_SIMULATED)
    ] = None
    mesh_max_mm: Annotated[
        Number | None, About("Largest distance of a node to the object itself", empty=_NOT_SIMULATED)
    ] = None


@dataclass(frozen=True)
class ProvenanceResult(Part):
    """Where a result comes from."""

    graspbench: Annotated[str | None, About("Version of graspbench")] = None
    git: Annotated[
        Mapping[str, Any] | None,
        About("Commit of the checkout, and whether it had changes", empty="it was no checkout"),
    ] = None
    python: Annotated[str | None, About("Version of Python")] = None
    libraries: Annotated[Mapping[str, str | None], About("Versions of libraries")] = field(
        default_factory=dict
    )
    host: Annotated[str | None, About("Name of the machine", empty="record.host is off")] = None
    platform: Annotated[str | None, About("Operating system")] = None
    cpu: Annotated[str | None, About("Processor")] = None
    cores: Annotated[int | None, About("Cores of the machine")] = None
    started: Annotated[str | None, About("When the trial began", empty="not recorded")] = None
    finished: Annotated[str | None, About("When the result was written")] = None
    seconds: Annotated[Number | None, About("Wall time of the trial", unit="s", empty="not recorded")] = None
    process: Annotated[int | None, About("Number of the process")] = None


@dataclass(frozen=True, kw_only=True)
class TrialResult(Part):
    """One trial: what it was, whether it ended, and what came of it."""

    trial_id: Annotated[str, About("Ten hexadecimal digits of a hash of what defines the trial")]
    status: Annotated[
        Status, About("done, failed, timeout, crashed, or unreadable (its file cannot be read)")
    ]
    reason: Annotated[str | None, About("Why the trial is not done, or fell short", empty="it is done")] = (
        None
    )
    success: Annotated[
        bool | None,
        About(
            "Whether the object was held through every phase asked for; of an in-hand motion, whether it was "
            "as asked. False also where no grasp was found to execute",
            empty="nothing was to be executed",
        ),
    ] = None
    seed: Annotated[int, About("Source of every random draw")] = 0
    kind: Annotated[Kind, About("trial (a grasp) or manipulation (an in-hand motion)")] = "trial"
    schema: Annotated[int, About("Version of the result's format")] = 0
    choice: Annotated[Mapping[str, str], About("Option chosen of each configuration group")] = field(
        default_factory=dict
    )
    overridden: Annotated[
        tuple[str, ...], About("Keys that the command line or an experiment set; each is a column")
    ] = ()
    config: Annotated[
        Mapping[str, Any],
        About("The whole configuration; overridden keys are columns of their own", column=False),
    ] = field(default_factory=dict)
    object: Annotated[ObjectResult, About("The object")] = ObjectResult("")
    hand: Annotated[HandResult, About("The hand")] = HandResult("", 0)
    index: Annotated[Mapping[str, Any], About("The index and its parameters, as in index.*")] = field(
        default_factory=dict
    )
    planned: Annotated[
        PlannedResult | None,
        About("Which planner planned, and when grasps came", empty=f"{_NOT_PLANNED}, or {_OLDER}"),
    ] = None
    local: Annotated[
        LocalResult | None,
        About("The planner's grasp: of the local planner, unless planner= names another", empty=_NOT_PLANNED),
    ] = None
    strengthened: Annotated[
        StrengthenedResult | None,
        About("The grasp that was executed", empty="the planner's own grasp was, or nothing"),
    ] = None
    explored: Annotated[
        ExploredResult | None,
        About("The grasp that exploring grasps chose", empty="execution.touch.max_grasps is 0"),
    ] = None
    restarted: Annotated[
        RestartedResult | None,
        About("The grasp of a multi-start on the finished surface", empty="planner.restart is off"),
    ] = None
    global_: Annotated[
        Mapping[str, GlobalGraspResult],
        About("The best grasp by each measure", empty="the measure was not searched for"),
    ] = field(default_factory=dict)
    ratio: Annotated[
        Mapping[str, Number], About("Local over global by each measure", empty="no global grasp is known")
    ] = field(default_factory=dict)
    refined: Annotated[
        Mapping[str, RefinedGraspResult],
        About("The local grasp climbed by each measure", empty="search.refine is off"),
    ] = field(default_factory=dict)
    moving: Annotated[
        MovingResult | None,
        About(
            "How the object moved while it was looked at", empty=f"scene.motion is none, or {_NOT_PLANNED}"
        ),
    ] = None
    reconstruction: Annotated[ReconstructionResult | None, About("The surface", empty=_NOT_PLANNED)] = None
    execution: Annotated[ExecutedResult | None, About("The execution in physics", empty=_NOT_EXECUTED)] = None
    manipulation: Annotated[
        ManipulationSummary | None, About("The in-hand motion", empty="not an in-hand motion")
    ] = None
    gait: Annotated[
        GaitFigures | None, About("The check of a motion by finger gaiting", empty="not by finger gaiting")
    ] = None
    sliding: Annotated[
        SlidingFigures | None, About("The check of contacts that slide on purpose", empty="none slides")
    ] = None
    in_hand: Annotated[PlayedResult | None, About("The in-hand motion in physics", empty=_NOT_EXECUTED)] = (
        None
    )
    times_s: Annotated[
        Mapping[str, Number],
        About("Seconds of each stage, compilation taken off", unit="s", empty="the stage was not run"),
    ] = field(default_factory=dict)
    compiled: Annotated[
        tuple[str, ...],
        About("Stages in which code was compiled; those that could be were run again for their times"),
    ] = ()
    provenance: Annotated[ProvenanceResult, About("Where the result comes from")] = field(
        default_factory=ProvenanceResult
    )
