"""How a body moves that slides and turns on a level table: a slowly varying twist, integrated on SE(3)."""

from dataclasses import dataclass, replace

import numpy as np

from graspbench.arrays import FloatArray

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)


@dataclass(frozen=True)
class PlanarMotion:
    """Where a body goes whose twist, as the turning body itself feels it, is constant or varies linearly.

    The twist is that of a body's point, the pivot: a velocity along the table, and a yaw rate. Both belong
    to the reference time. A straight conveyor, a turntable (the pivot runs along a circle) and a drift are
    of this kind.

    Attributes:
        pivot: The body's point at the reference time, world frame, shape (3,), m.
        reference_time_s: When the body is where the other attributes say.
        velocity_m_s: The pivot's velocity along the world's x and y, shape (2,).
        yaw_rate_rad_s: About the world's z axis.
        velocity_change_m_s2: Rate of change of the velocity in axes that turn with the body, shape (2,).
        yaw_acceleration_rad_s2: Rate of change of the yaw rate.
    """

    pivot: FloatArray
    reference_time_s: float
    velocity_m_s: tuple[float, float] = (0.0, 0.0)
    yaw_rate_rad_s: float = 0.0
    velocity_change_m_s2: tuple[float, float] = (0.0, 0.0)
    yaw_acceleration_rad_s2: float = 0.0

    @property
    def speed_m_s(self) -> float:
        """How fast the pivot moves at the reference time."""
        return float(np.hypot(*self.velocity_m_s))

    @property
    def varies(self) -> bool:
        """Whether the twist changes."""
        return any(self.velocity_change_m_s2) or self.yaw_acceleration_rad_s2 != 0.0

    def yaws(self, times_s: FloatArray) -> FloatArray:
        """Return how far the body has turned since the reference time, shape (n,), rad."""
        after = np.asarray(times_s, dtype=np.float64) - self.reference_time_s
        turned: FloatArray = self.yaw_rate_rad_s * after + 0.5 * self.yaw_acceleration_rad_s2 * after**2
        return turned

    def displacements(self, times_s: FloatArray) -> FloatArray:
        """Return the transforms that carry the body from where it is at the reference time.

        Args:
            times_s: Shape (n,).

        Returns:
            Each maps a world point of the body at the reference time to where it is then, shape (n, 4, 4).
        """
        times = np.atleast_1d(np.asarray(times_s, dtype=np.float64))
        after = times - self.reference_time_s
        # Gauss and Legendre over the time gone by: exact to round-off for a few turns.
        within = 0.5 * after[:, None] * (1.0 + _NODES)
        angles = self.yaw_rate_rad_s * within + 0.5 * self.yaw_acceleration_rad_s2 * within**2
        u = self.velocity_m_s[0] + self.velocity_change_m_s2[0] * within
        v = self.velocity_m_s[1] + self.velocity_change_m_s2[1] * within
        c, s = np.cos(angles), np.sin(angles)
        weights = 0.5 * after[:, None] * _WEIGHTS
        yaw = self.yaws(times)
        moved = np.tile(np.eye(4), (len(times), 1, 1))
        moved[:, 0, 0] = moved[:, 1, 1] = np.cos(yaw)
        moved[:, 1, 0] = np.sin(yaw)
        moved[:, 0, 1] = -moved[:, 1, 0]
        shift = np.column_stack(
            ((weights * (c * u - s * v)).sum(axis=1), (weights * (s * u + c * v)).sum(axis=1))
        )
        moved[:, :2, 3] = self.pivot[:2] + shift - np.einsum("nij,j->ni", moved[:, :2, :2], self.pivot[:2])
        return moved

    def displacement(self, time_s: float) -> FloatArray:
        """Return the transform of `displacements` for one time, shape (4, 4)."""
        moved: FloatArray = self.displacements(np.array([time_s]))[0]
        return moved

    def places(self, times_s: FloatArray) -> FloatArray:
        """Return where the pivot is, shape (n, 3)."""
        moved = self.displacements(times_s)
        return np.asarray(moved[:, :3, :3] @ self.pivot + moved[:, :3, 3])

    def since(self, time_s: float) -> "PlanarMotion":
        """Return the same motion with another reference time."""
        moved = self.displacement(time_s)
        after = time_s - self.reference_time_s
        velocity = np.array(self.velocity_m_s) + after * np.array(self.velocity_change_m_s2)
        turned = moved[:2, :2]
        return replace(
            self,
            pivot=moved[:3, :3] @ self.pivot + moved[:3, 3],
            reference_time_s=time_s,
            velocity_m_s=tuple((turned @ velocity).tolist()),
            yaw_rate_rad_s=self.yaw_rate_rad_s + after * self.yaw_acceleration_rad_s2,
            velocity_change_m_s2=tuple((turned @ np.array(self.velocity_change_m_s2)).tolist()),
        )

    def about(self, pivot: FloatArray) -> "PlanarMotion":
        """Return the same motion told of another point of the body, shape (3,), as it is at the reference."""
        arm = np.array([self.pivot[1] - pivot[1], pivot[0] - self.pivot[0]])
        velocity = np.array(self.velocity_m_s) + self.yaw_rate_rad_s * arm
        change = np.array(self.velocity_change_m_s2) + self.yaw_acceleration_rad_s2 * arm
        return replace(
            self,
            pivot=np.array(pivot, dtype=np.float64),
            velocity_m_s=tuple(velocity.tolist()),
            velocity_change_m_s2=tuple(change.tolist()),
        )
