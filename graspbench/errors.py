"""The tree of errors: one sentence for the reader, the data for the program."""

from typing import Any


class GraspbenchError(Exception):
    """Base of every error that Graspbench raises on purpose.

    Args:
        what: What is wrong and where, one clause without a final full stop.
        remedy: What the reader can do about it, one clause without a final full stop.
        **data: Values a program may want: paths, names, numbers, the offending object.
    """

    exit_code = 1

    def __init__(self, what: str, *, remedy: str | None = None, **data: Any) -> None:
        self.what = what
        self.remedy = remedy
        self.data = data
        super().__init__(f"{what}: {remedy}." if remedy else f"{what}.")

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (type(self), self.what, self.remedy, self.data)


def _rebuild(
    kind: type[GraspbenchError], what: str, remedy: str | None, data: dict[str, Any]
) -> GraspbenchError:
    return kind(what, remedy=remedy, **data)


class InputError(GraspbenchError):
    """What the user gave cannot be used; nothing was run or written (exit code 2)."""

    exit_code = 2


class ConfigurationError(InputError):
    """An option is unknown, or its value is of the wrong type or out of range."""


class MeshError(InputError):
    """A mesh is missing, unreadable, open, of several bodies, or not of genus 0."""


class ImageError(InputError):
    """An image or silhouette cannot be used: empty, full, cut by the border, or ambiguous."""


class StationError(InputError):
    """The camera stations are degenerate or cannot be reached."""


class HandError(InputError):
    """A hand's description is missing, inconsistent, or does not fit the task."""


class LogError(InputError):
    """A log or result file is missing, unreadable or of an unknown version."""


class OutputError(InputError):
    """Results cannot be written where they should go: no folder, no right, no room."""


class TrialError(GraspbenchError):
    """A well-posed trial failed while it ran (exit code 1)."""


class ReconstructionError(TrialError):
    """The surface cannot be reconstructed from the silhouettes."""


class PlanningError(TrialError):
    """No grasp meets the constraints."""


class SimulationError(TrialError):
    """The physics simulation ended in a state that cannot be used."""


class ManipulationError(TrialError):
    """The inverse kinematics of hand and object cannot go on."""
