"""Where a finger touches: a sphere that follows the end of its last link, on the side that closes."""

from dataclasses import dataclass

import coal
import numpy as np
import pinocchio

from graspbench.arrays import FloatArray
from graspbench.errors import HandError
from graspbench.hand.chains import coupling, motion_axis
from graspbench.hand.importing.pads import fit_pad
from graspbench.hand.importing.ranges import usual_range
from graspbench.hand.importing.structure import FoundFinger
from graspbench.hand.importing.surfaces import surface_points

_BARE_RADIUS_M = 0.008


@dataclass(frozen=True)
class LastLink:
    """The end of a finger in the frame of its last joint.

    Attributes:
        joint: Number of Pinocchio's joint.
        to_link: Pose of the last link's frame in the joint's, shape (4, 4).
        points: Points on its shapes, shape (n, 3), m; none where it has no shape.
        balls: Centres and radii of its spheres, shape (b, 4), m.
        axis: The joint's axis, shape (3,).
        outwards: From palm to tip, across the axis, shape (3,).
        pad: The side that closes, across both, shape (3,).
    """

    joint: int
    to_link: FloatArray
    points: FloatArray
    balls: FloatArray
    axis: FloatArray
    outwards: FloatArray
    pad: FloatArray


@dataclass(frozen=True)
class FoundTip:
    """A fingertip.

    Attributes:
        centre: Centre of the sphere in the last joint's frame, shape (3,), m.
        radius_m: Its radius.
        source: Where it comes from, in words.
    """

    centre: FloatArray
    radius_m: float
    source: str


def last_link(
    model: pinocchio.Model, geometry: pinocchio.GeometryModel, finger: FoundFinger, palm: pinocchio.SE3
) -> LastLink:
    """Look at the end of a finger; ``pad`` is still one of two sides (see ``oriented``)."""
    joint = model.getJointId(finger.joints[-1])
    link = model.frames[model.getFrameId(finger.link)].placement
    clouds, balls = [], []
    for item in geometry.geometryObjects:
        if item.parentJoint != joint:
            continue
        points = surface_points(item.geometry) @ item.placement.rotation.T + item.placement.translation
        clouds.append(points)
        if isinstance(item.geometry, coal.Sphere):
            balls.append([*item.placement.translation, item.geometry.radius])
    points = np.concatenate(clouds) if clouds else np.zeros((0, 3))
    slides, axis = joint_axis(model, joint)
    if slides:
        # The finger of a gripper points away from the palm.
        data = model.createData()
        pinocchio.forwardKinematics(model, data, middle(model))
        back = data.oMi[joint].actInv(palm)
        away = (points.mean(axis=0) if len(points) else link.translation) - back.translation
    elif len(points):
        across = points - np.outer(points @ axis, axis)
        far = np.linalg.norm(across, axis=1)
        away = across[far >= np.quantile(far, 0.95)].mean(axis=0)
    else:
        away = _frame_in_joint(model, finger).translation
    away = away - (away @ axis) * axis
    length = float(np.linalg.norm(away))
    if length < 1e-4:
        away = np.eye(3)[int(np.argmin(np.abs(axis)))]
        away = away - (away @ axis) * axis
        length = float(np.linalg.norm(away))
    outwards = away / length
    pad = axis if slides else np.cross(axis, outwards)
    return LastLink(
        joint, np.array(link.homogeneous), points, np.array(balls).reshape(-1, 4), axis, outwards, pad
    )


def fit_tip(model: pinocchio.Model, finger: FoundFinger, last: LastLink, radius_m: float | None) -> FoundTip:
    """Fit a sphere to the end of a finger.

    A sphere of the description that reaches as far as anything is taken as it is. Otherwise it is the one
    that follows the link's pad (see ``fit_pad``).

    Args:
        model: The hand.
        finger: The finger.
        last: Its end, its pad on the side that closes.
        radius_m: Radius to take; None to find one.
    """
    if not len(last.points):
        frame = _frame_in_joint(model, finger)
        if np.linalg.norm(frame.translation) < 1e-6:
            raise HandError(
                f"finger '{finger.name}' of hand '{model.name}' has no collision shape behind joint "
                f"'{finger.joints[-1]}', and no frame of a tip",
                remedy=f"say where its tip is with --tip {finger.name}=LINK:X,Y,Z",
                finger=finger.name,
            )
        return FoundTip(frame.translation, radius_m or _BARE_RADIUS_M, f"the frame '{finger.frame}'")
    end = float((last.points @ last.outwards).max())
    reaching = last.balls[last.balls[:, :3] @ last.outwards + last.balls[:, 3] >= end - 1e-3]
    if radius_m is None and len(reaching):
        best = reaching[int(np.argmax(reaching[:, 3]))]
        return FoundTip(best[:3], float(best[3]), "a sphere of the description")
    whose = f"finger '{finger.name}' of hand '{model.name}'"
    pad = fit_pad(last.points, pad_axes(last), radius_m, whose)
    return FoundTip(
        pad.centre, pad.radius_m, f"the pad of its last link, {1e3 * pad.proud_m:.1f} mm proud at most"
    )


def pad_axes(last: LastLink) -> FloatArray:
    """Return rows: the side that closes, the direction of the tip, and across both, shape (3, 3)."""
    return np.array([last.pad, last.outwards, np.cross(last.pad, last.outwards)])


def joint_axis(model: pinocchio.Model, joint: int) -> tuple[bool, FloatArray]:
    """Return whether a joint slides, and its axis in its own frame."""
    return motion_axis(model, joint, model.name)


def middle(model: pinocchio.Model) -> FloatArray:
    """Return the joints in the middle of their usual ranges, shape (n_q,)."""
    lower, upper = np.asarray(model.lowerPositionLimit), np.asarray(model.upperPositionLimit)
    turns = np.ones(model.nq, dtype=bool)
    for joint in range(1, model.njoints):
        turns[model.joints[joint].idx_q] &= not joint_axis(model, joint)[0]
    usual = usual_range(lower, upper, turns)
    return np.asarray(0.5 * (usual[0] + usual[1]))


def _frame_in_joint(model: pinocchio.Model, finger: FoundFinger) -> pinocchio.SE3:
    return model.frames[model.getFrameId(finger.frame or finger.link)].placement


def closing_sides(model: pinocchio.Model, lasts: list[LastLink], ends: list[FloatArray]) -> list[FloatArray]:
    """Tell for each finger which side of its last link closes: the one towards the other fingers.

    Where its joint can turn further one way than the other from where the link is in line, that decides with
    it: fingers bend further inwards than outwards.

    Args:
        model: The hand.
        lasts: The fingers' ends.
        ends: A point at the end of each, last joint's frame, shape (3,), m.
    """
    data = model.createData()
    pinocchio.forwardKinematics(model, data, middle(model))
    placed = [data.oMi[last.joint] for last in lasts]
    tips = np.array([pose.act(end) for pose, end in zip(placed, ends, strict=True)])
    found = []
    for f, (last, pose) in enumerate(zip(lasts, placed, strict=True)):
        others = np.delete(tips, f, axis=0).mean(axis=0)
        towards = pose.rotation.T @ (others - tips[f])
        towards = towards / max(float(np.linalg.norm(towards)), 1e-9)
        score = float(towards @ last.pad)
        slides = joint_axis(model, last.joint)[0]
        if not slides:
            i = model.joints[last.joint].idx_q
            ratio, offset = coupling(model, last.joint)
            low, high = sorted(
                (ratio * model.lowerPositionLimit[i] + offset, ratio * model.upperPositionLimit[i] + offset)
            )
            score += (high + low) / max(high - low, 1e-9)
        found.append(last.pad if score >= 0.0 else -last.pad)
    return found
