"""The approach of a hand along its planned path, up to the touch of every finger."""

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from graspbench.arrays import FloatArray
from graspbench.grasp.configuration import Grasp
from graspbench.simulation.stage import JointPath, Stage
from graspbench.simulation.touch import Touch

# Far from the object nothing but the motors acts, and long steps do; nothing crosses the near zone between
# two looks.
_FREE_STEP_S = 0.004
_LOOK_S = 0.02
_NEAR_M = 0.006
# A finger that brushes past the object farther from the end of its path than this goes on.
_ARRIVAL_M = 0.015


class Approach:
    """The approach up to the touch of every finger.

    Attributes:
        contact_time_s: When each finger touched first, nan before, shape (n_fingers,).
        touch: How each finger touched first.
        place: Where that was, as seen from where the grasp is planned, shape (3,) each.
    """

    def __init__(self, stage: Stage, grasp: Grasp, fingers: tuple[int, ...]) -> None:
        self._stage, self._model = stage, stage.model
        self._grasp, self._fingers = grasp, fingers
        n = self._model.n_fingers
        self.contact_time_s = np.full(n, np.nan)
        self.touch: dict[int, Touch] = {}
        self.place: dict[int, FloatArray] = {}
        self._arriving = np.zeros(n, dtype=bool)
        self._own = {f: self._model.finger_joints(f).tolist() for f in fingers}
        self._goal = np.empty(0)
        self._palm = np.eye(4)

    def use(self, grasp: Grasp) -> None:
        """Close along another grasp's normals; its contacts are those of the same fingers."""
        self._grasp = grasp

    def follow(self, path: JointPath, *, arriving: bool = True) -> float:
        """Play the path; return the largest distance of a free fingertip from it.

        Args:
            path: The planned motion, or a part of it.
            arriving: Whether it ends on the contacts; else no touch is expected.
        """
        stage, dt = self._stage, self._stage.time_step_s
        times = np.asarray(path.times)
        steps = max(1, round(float(times[-1]) / dt))
        at = np.arange(steps + 1, dtype=np.float64) * dt
        wanted = _resampled(at, times, path.joints)
        palms = _resampled_poses(at, times, path.transform_palm_to_world)
        self._goal, self._palm = wanted[0].copy(), palms[0]
        stride, look = max(1, round(_FREE_STEP_S / dt)), max(1, round(_LOOK_S / dt))
        ends = self._tips(wanted[-1], palms[-1])
        worst, k, next_look, count = 0.0, 0, 0, 1
        stage.sample()
        while k < steps:
            if k >= next_look:
                count, next_look = 1 if stage.hand.is_near_object(_NEAR_M) else stride, k + look
                planned = self._tips(wanted[k], palms[k])
                worst = max(worst, self._tip_error(planned))
                self._arriving = arriving & (np.linalg.norm(planned - ends, axis=1) < _ARRIVAL_M)
            count = min(count, steps - k)
            k += count
            self._palm = palms[k]
            stage.hand.drive_wrist(stage.carried(self._palm, count * dt), count * dt)
            self._drive(wanted[k], count * dt)
            stage.step(count)
            self._feel()
        self._arriving[:] = arriving
        return worst

    def close(self) -> None:
        """Move the fingers that do not touch yet on along their contacts' normals."""
        stage, p = self._stage, self._stage.parameters
        steps = int(np.ceil(p.closing_distance_m / (p.closing_speed_m_s * stage.time_step_s)))
        rotation = self._palm[:3, :3]
        for _ in range(steps):
            free = [i for i, f in enumerate(self._fingers) if np.isnan(self.contact_time_s[f])]
            if not free:
                break
            wanted = self._goal.copy()
            jacobians = self._model.tip_jacobians(self._goal)
            for i in free:
                index = self._own[self._fingers[i]]
                jacobian = jacobians[self._fingers[i]][:, index]
                inward = -p.closing_speed_m_s * (rotation.T @ self._grasp.normals[i])
                damped = jacobian @ jacobian.T + 1e-6 * np.eye(3)
                wanted[index] += stage.time_step_s * (jacobian.T @ np.linalg.solve(damped, inward))
            self._drive(np.clip(wanted, self._model.lower, self._model.upper), stage.time_step_s)
            stage.hand.drive_wrist(stage.carried(self._palm, stage.time_step_s), stage.time_step_s)
            stage.step()
            self._feel()

    def _drive(self, wanted: FloatArray, time_s: float) -> None:
        """Move the goal of free fingers; the others stay where they touched."""
        goal = wanted.copy()
        touching = [np.isfinite(self.contact_time_s[f]) for f in self._fingers]
        # Joints that move a finger that does not touch yet go on, as in a parallel gripper.
        going = {i for f, on in zip(self._fingers, touching, strict=True) if not on for i in self._own[f]}
        for f, on in zip(self._fingers, touching, strict=True):
            if on:
                index = [i for i in self._own[f] if i not in going]
                goal[index] = self._goal[index]
        velocity = (goal - self._goal) / time_s
        self._goal = goal
        self._stage.hand.drive_joints(goal, velocity)

    def _feel(self) -> None:
        touches: tuple[Touch | None, ...] = self._stage.hand.touches(self._stage.parameters.contact_force_n)
        for f in self._fingers:
            touch = touches[f]
            if touch is not None and self._arriving[f] and np.isnan(self.contact_time_s[f]):
                self.contact_time_s[f] = self._stage.time_s
                self.touch[f] = touch
                there = np.eye(4)
                there[:3, 3] = touch.point
                self.place[f] = self._stage.as_planned(there)[:3, 3]

    def _tip_error(self, planned: FloatArray) -> float:
        """Return the largest distance of a free fingertip from where it should be, shape (n, 3)."""
        free = [f for f in self._fingers if np.isnan(self.contact_time_s[f])]
        real = self._tips(self._stage.hand.state()[0], self._stage.palm_pose())
        return float(np.linalg.norm(real - planned, axis=1)[free].max(initial=0.0))

    def _tips(self, joints: FloatArray, palm: FloatArray) -> FloatArray:
        """Return the centres of all fingertips in the world, shape (n, 3)."""
        tips: FloatArray = self._model.tip_positions(joints) @ palm[:3, :3].T + palm[:3, 3]
        return tips


def _resampled_poses(at: FloatArray, times: FloatArray, poses: FloatArray) -> FloatArray:
    """Return poses between samples: positions linearly, orientations along great circles."""
    out = np.tile(np.eye(4), (len(at), 1, 1))
    out[:, :3, 3] = _resampled(at, times, poses[:, :3, 3])
    if len(times) > 1:
        slerp = Slerp(times, Rotation.from_matrix(poses[:, :3, :3]))
        out[:, :3, :3] = slerp(np.clip(at, times[0], times[-1])).as_matrix()
    else:
        out[:, :3, :3] = poses[0, :3, :3]
    return out


def _resampled(at: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
    return np.column_stack([np.interp(at, times, values[:, k]) for k in range(values.shape[1])])
