"""Where the fingers touch an object that moves, also while one of them is not felt for a moment."""

from collections.abc import Sequence
from dataclasses import replace

from graspbench.simulation.stage import Stage
from graspbench.simulation.touch import Touch


class FeltContacts:
    """The last contacts that were felt, carried along by the object.

    Args:
        stage: Hand and object.
    """

    def __init__(self, stage: Stage) -> None:
        self._world = stage.world
        self._local: tuple[Touch, ...] = ()

    def begin(self, touches: Sequence[Touch]) -> None:
        """Start from these contacts."""
        self._local = tuple(self._on_object(touch) for touch in touches)

    def now(self, felt: Sequence[Touch | None]) -> list[Touch]:
        """Return the contacts; one that is not felt is where it was on the object, without force."""
        pose = self._world.object_pose()
        known = []
        for touch, last in zip(felt, self._local, strict=True):
            if touch is None:
                point = pose[:3, :3] @ last.point + pose[:3, 3]
                touch = replace(last, force_n=0.0, point=point, normal=pose[:3, :3] @ last.normal)
            known.append(touch)
        self.begin(known)
        return known

    def memory(self) -> tuple[Touch, ...]:
        """Return what `recall` takes."""
        return self._local

    def recall(self, memory: tuple[Touch, ...]) -> None:
        """Return to a time before."""
        self._local = memory

    def _on_object(self, touch: Touch) -> Touch:
        pose = self._world.object_pose()
        point = pose[:3, :3].T @ (touch.point - pose[:3, 3])
        return replace(touch, point=point, normal=pose[:3, :3].T @ touch.normal)
