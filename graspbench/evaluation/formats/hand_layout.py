"""How a format states a hand: which frame its pose is of, and which joint comes when."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.reading import Reading
from graspbench.evaluation.grasp_record import HandPose
from graspbench.evaluation.transforms import inverse
from graspbench.hand.model import HandModel
from graspbench.hand.parameters import FileFrame


@dataclass(frozen=True, eq=False)
class HandLayout:
    """A hand as the files of a format state it.

    Attributes:
        hand: The hand.
        file_joints: Names of its joints in the files, in their order.
        to_hand: Position in the hand's joint vector of each of them, shape (k,).
        transform_palm_to_file: Pose of the palm frame in the files' hand frame, shape (4, 4).
    """

    hand: HandModel
    file_joints: tuple[str, ...]
    to_hand: tuple[int, ...]
    transform_palm_to_file: FloatArray

    @cached_property
    def _transform_file_to_palm(self) -> FloatArray:
        return inverse(self.transform_palm_to_file)

    def pose(self, transform_file_to_object: FloatArray, row: FloatArray) -> HandPose:
        """Return palm and joints of a pose and a row of joints as the file has them, shape (k,)."""
        joints = self.hand.rest.copy()
        joints[list(self.to_hand)] = row
        return HandPose(transform_file_to_object @ self.transform_palm_to_file, joints)

    def pose_by_name(
        self, transform_file_to_object: FloatArray, joints: Mapping[str, float], where: str, reading: Reading
    ) -> HandPose:
        """Return palm and joints where the file names the joints.

        Raises:
            GraspFileError: A joint is missing, or one is named that the hand has not.
        """
        known = dict(zip(self.file_joints, self.to_hand, strict=True))
        # What follows other joints may be there or not: it has no say of its own.
        followers = {each.name for each in self.hand.followers}
        missing = sorted(set(known) - set(joints))
        unknown = sorted(set(joints) - set(known) - followers)
        if missing or unknown:
            what = f"has no joint '{missing[0]}'" if missing else f"has a joint '{unknown[0]}'"
            raise GraspFileError(
                f"{where} {what}, and hand '{self.hand.name}' has {', '.join(known)}",
                remedy="choose the hand that the file is of, or state its names with hand.formats",
            )
        row = reading.row(np.array([joints[name] for name in self.file_joints]))
        return self.pose(transform_file_to_object, row)

    def stated(self, pose: HandPose) -> tuple[FloatArray, FloatArray]:
        """Return the transform, shape (4, 4), and the joints, shape (k,), as the files state a pose."""
        return pose.transform_palm_to_object @ self._transform_file_to_palm, pose.joints[list(self.to_hand)]


def hand_layout(hand: HandModel, name: str) -> HandLayout:
    """Return how the files of a format state a hand: as ``hand.formats`` says, else root link and own order.

    Raises:
        HandError: ``hand.formats`` names a link or joint that the hand has not, or a link that moves.
    """
    frame = hand.file_frames.get(name, FileFrame())
    chosen = dict(frame.joints) or {joint: joint for joint in hand.joint_names}
    if unknown := sorted(set(chosen.values()) - set(hand.joint_names)):
        raise HandError(
            f"hand.formats.{name}.joints names '{unknown[0]}', which hand '{hand.name}' has not",
            remedy=f"choose from {', '.join(hand.joint_names)}",
        )
    if len(set(chosen.values())) < len(chosen):
        raise HandError(
            f"hand.formats.{name}.joints names a joint of hand '{hand.name}' twice", remedy="name each once"
        )
    placement = _link_placement(hand, frame.link, name)
    turn = pinocchio.rpy.rpyToMatrix(np.radians(frame.rpy_deg))
    file_to_root = np.array((placement * pinocchio.SE3(turn, np.array(frame.xyz_m))).homogeneous)
    return HandLayout(
        hand=hand,
        file_joints=tuple(chosen),
        to_hand=_positions(hand.joint_names, tuple(chosen.values())),
        transform_palm_to_file=inverse(file_to_root) @ hand.transform_palm_to_root,
    )


def _positions(names: Sequence[str], wanted: Sequence[str]) -> tuple[int, ...]:
    at = {name: i for i, name in enumerate(names)}
    return tuple(at[name] for name in wanted)


def _link_placement(hand: HandModel, link: str | None, name: str) -> pinocchio.SE3:
    if link is None:
        return pinocchio.SE3.Identity()
    model = hand.model
    frame = model.frames[model.getFrameId(link)] if model.existFrame(link) else None
    if frame is None or frame.parentJoint != 0:
        what = "has no such link" if frame is None else "moves it"
        raise HandError(
            f"hand.formats.{name}.link is '{link}', but hand '{hand.name}' {what}",
            remedy="name a link that is fixed to the palm",
        )
    return frame.placement
