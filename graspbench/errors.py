"""The tree of errors: one sentence for the reader, the data for the program."""

import reprlib
from typing import Any

_MAX_WHAT = 500
_MAX_REMEDY = 2000
_ELLIPSIS = " ... "


class GraspbenchError(Exception):
    """Base of every error that Graspbench raises on purpose.

    Args:
        what: What is wrong and where, one clause without a final full stop.
        remedy: What the reader can do about it, one clause without a final full stop.
        **data: Values a program may want: paths, names, numbers, the offending object.
    """

    exit_code = 1

    def __init__(self, what: str, *, remedy: str | None = None, **data: Any) -> None:
        self.what = sentence(what, _MAX_WHAT)
        self.remedy = None if remedy is None else sentence(remedy, _MAX_REMEDY)
        self.data = data
        super().__init__(f"{self.what}: {self.remedy}." if self.remedy else f"{self.what}.")

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (type(self), self.what, self.remedy, self.data)


def sentence(text: str, longest: int) -> str:
    """Return text as one line: what cannot be printed is escaped, the middle of long text is left out."""
    if len(text) > longest:
        head = 2 * longest // 3
        text = text[:head] + _ELLIPSIS + text[len(text) - (longest - head) :]
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else " " if c.isspace() else ascii(c)[1:-1] for c in text)


def shown(value: object) -> str:
    """Return how a value that cannot be used is quoted, as far as a sentence has room for it."""
    try:
        return _BRIEF.repr(value)
    except ValueError:  # a whole number of thousands of digits
        return "a number of thousands of digits"


_BRIEF = reprlib.Repr()
_BRIEF.maxstring = _BRIEF.maxother = _BRIEF.maxlong = 80
_BRIEF.maxlevel = 3


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
    """A mesh is missing, unreadable, open, of several bodies, or with holes too thin to be meant."""


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
