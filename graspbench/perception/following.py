"""A moving object followed by the camera: where its centre is and where it will be, from image to image."""

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.perception.silhouette import Silhouette

_FIRST_POSITION_M = 0.1
_FIRST_SPEED_M_S = 0.2
_CENTROID_M = 4e-3
_ACCELERATION = 0.04  # m/s^2 per root of a hertz

_LEVEL = np.array([1.0, 1.0, 0.02])
"""What rests on a table hardly rises."""


class CentreFollower:
    """Linear Kalman filter of an object's centre and velocity, fed with the viewing rays of its centroids.

    A ray says nothing of the distance along it; over several directions the filter triangulates. The velocity
    wanders as white noise of the acceleration makes it, so a slowly turning one is followed too.

    Args:
        guess: First guess of the centre, shape (3,).
        time_s: When.

    Attributes:
        time_s: Time of the last image.
    """

    def __init__(self, guess: FloatArray, time_s: float) -> None:
        self.time_s = time_s
        self._state = np.concatenate((guess, np.zeros(3)))
        deviations = np.concatenate((np.full(3, _FIRST_POSITION_M), _FIRST_SPEED_M_S * _LEVEL))
        self._covariance = np.diag(deviations**2)

    def predicted(self, time_s: float) -> FloatArray:
        """Return where the centre will be, shape (3,)."""
        place: FloatArray = self._state[:3] + (time_s - self.time_s) * self._state[3:]
        return place

    @property
    def velocity_m_s(self) -> FloatArray:
        """Velocity at the last image, shape (3,)."""
        return self._state[3:].copy()

    def see(self, silhouette: Silhouette, time_s: float) -> None:
        """Take in the centroid of an image taken at a time, not before the last one."""
        self._advance(time_s)
        origin = silhouette.camera.position
        ray = silhouette.camera.rays(silhouette.centroid[None])[0]
        # Two directions across the ray are measured.
        across = np.linalg.svd(ray[None])[2][1:]
        measured = np.hstack((across, np.zeros((2, 3))))
        innovation = across @ (origin - self._state[:3])
        spread = measured @ self._covariance @ measured.T + _CENTROID_M**2 * np.eye(2)
        gain = np.linalg.solve(spread, measured @ self._covariance).T
        self._state = self._state + gain @ innovation
        kept = np.eye(6) - gain @ measured
        self._covariance = kept @ self._covariance @ kept.T + _CENTROID_M**2 * gain @ gain.T

    def _advance(self, time_s: float) -> None:
        dt = time_s - self.time_s
        step = np.eye(6)
        step[:3, 3:] = dt * np.eye(3)
        level = np.diag(_LEVEL**2)
        noise = np.block([[dt**3 / 3.0 * level, dt**2 / 2.0 * level], [dt**2 / 2.0 * level, dt * level]])
        self._state = step @ self._state
        self._covariance = step @ self._covariance @ step.T + _ACCELERATION**2 * noise
        self.time_s = time_s
