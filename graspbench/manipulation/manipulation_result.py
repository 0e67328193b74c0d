"""What came of an in-hand motion."""

from dataclasses import dataclass, field

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.manipulation.classification import GraspClass
from graspbench.manipulation.loop import ClikHistory
from graspbench.manipulation.sliding.sliding_history import SlidingHistory


@dataclass(frozen=True, eq=False)
class ManipulationResult:
    """A motion of hand and object.

    Attributes:
        history: Everything by time, palm frame; the first finger of its arrays is the grasp's first contact.
        joint_names: Names of the joints' columns.
        grasp_class: Class of the grasp at the start.
        transform_palm_to_world: Pose of the palm, shape (4, 4); it stays where it is.
        transforms_object_to_palm: Pose of the object by time, shape (t, 4, 4).
        desired_transforms_object_to_palm: Pose asked for, shape (t, 4, 4).
        position_error_m: Largest position error of a finger's loop, shape (t,).
        rotation_error_deg: Largest orientation error, shape (t,).
        contact_points: Contacts on the object, object frame, shape (t, n_c, 3), m.
        contact_normals: Outward normals there, object frame, shape (t, n_c, 3).
        contact_drift_m: How far each contact is from where its contact type lets it be, shape (t, n_c).
        force_times: When the forces were computed, shape (s,), s.
        forces: Fingers' forces on the object, palm frame, shape (s, n_c, 3), N; NaN where none balance.
        torsions: Fingers' torques about the outward normals, shape (s, n_c), N m; NaN likewise.
        force_margins: Smallest margin to a friction cone's side, shape (s,), N; NaN likewise.
        pad_indentation_max_m: Deepest indentation of a soft pad; None for other contacts.
        sliding: How the tips slide; None unless contacts slide on purpose.
    """

    history: ClikHistory
    joint_names: tuple[str, ...]
    grasp_class: GraspClass
    transform_palm_to_world: FloatArray
    transforms_object_to_palm: FloatArray
    desired_transforms_object_to_palm: FloatArray
    position_error_m: FloatArray
    rotation_error_deg: FloatArray
    contact_points: FloatArray
    contact_normals: FloatArray
    contact_drift_m: FloatArray
    force_times: FloatArray
    forces: FloatArray
    torsions: FloatArray
    force_margins: FloatArray
    pad_indentation_max_m: float | None = field(default=None, kw_only=True)
    sliding: SlidingHistory | None = field(default=None, kw_only=True)

    def summary(self) -> dict[str, float | int | bool | None]:
        """Return the figures that decide, by name."""
        known = self.force_margins[np.isfinite(self.force_margins)]
        return {
            "duration_s": float(self.history.times[-1]),
            "position_error_max_m": float(self.position_error_m.max()),
            "rotation_error_max_deg": float(self.rotation_error_deg.max()),
            "contact_drift_max_m": float(self.contact_drift_m.max()),
            "closed_chain_residual_max_m": float(self.history.closed_chain_residual_m.max()),
            "joint_velocity_max_rad_s": float(
                np.abs(self.history.velocities[:, : self.history.joints.shape[1]]).max()
            ),
            "redundant": self.grasp_class.redundant,
            "indeterminate": self.grasp_class.indeterminate,
            "degrees_of_freedom": self.grasp_class.degrees_of_freedom,
            "force_margin_min_n": float(known.min()) if known.size else float("nan"),
            "pad_indentation_max_m": self.pad_indentation_max_m,
            "balanced_share": float(known.size / max(len(self.force_margins), 1)),
        }
