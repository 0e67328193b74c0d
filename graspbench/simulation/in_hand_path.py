"""A planned in-hand motion as physics plays it: joints and the object's pose by time, and fingers' steps."""

from dataclasses import dataclass

import numpy as np

from graspbench.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class StepOnPath:
    """A step of one finger along a path.

    Attributes:
        contact: Whose finger.
        from_s: When it leaves the object.
        to_s: When it shall be on it again.
        inward: Normal into the object where it lands, palm frame, shape (3,).
    """

    contact: int
    from_s: float
    to_s: float
    inward: FloatArray


@dataclass(frozen=True, eq=False)
class InHandPath:
    """What the fingers shall do with the object, from the grasp on; the palm stays.

    Attributes:
        times: Ascending times from 0, shape (t,), s.
        joints: Joint positions, shape (t, n_q), rad.
        transforms_object_to_palm: The object's pose, shape (t, 4, 4); any frame that is fixed to it.
        axis: What the object turns about, palm frame, shape (3,); None where that is not asked.
        steps: Steps of single fingers meanwhile, in order of time.
        sliding: Contacts that slide over the object, so that they take no share of grip and weight.
        sliding_n: Their normal force.
    """

    times: FloatArray
    joints: FloatArray
    transforms_object_to_palm: FloatArray
    axis: FloatArray | None = None
    steps: tuple[StepOnPath, ...] = ()
    sliding: tuple[int, ...] = ()
    sliding_n: float = 0.0

    def joints_at(self, time_s: float) -> FloatArray:
        """Return the joint positions at a time, shape (n_q,)."""
        after = min(max(int(np.searchsorted(self.times, time_s)), 1), len(self.times) - 1)
        span = self.times[after] - self.times[after - 1]
        share = (time_s - self.times[after - 1]) / span
        joints: FloatArray = (1.0 - share) * self.joints[after - 1] + share * self.joints[after]
        return joints

    def moved_at(self, time_s: float) -> FloatArray:
        """Return what takes the object's pose in the palm at the start to that at a time, shape (4, 4)."""
        poses = self.transforms_object_to_palm
        at = min(int(np.searchsorted(self.times, time_s)), len(self.times) - 1)
        moved: FloatArray = poses[at] @ np.linalg.inv(poses[0])
        return moved
