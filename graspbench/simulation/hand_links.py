"""The links and joints of a hand that is loaded into PyBullet: whose they are, and which follow others."""

from graspbench.arrays import FloatArray
from graspbench.hand.model import HandModel
from graspbench.simulation.bullet import pybullet

_GEAR_ERP, _GEAR_FORCE = 0.8, 1e3


def fingers_of_links(
    client: int, body: int, hand: HandModel, links: dict[str, int], ids: dict[str, int]
) -> dict[int, tuple[int, bool]]:
    """Map every link of a used finger to the finger, and whether it is its tip."""
    parent = {i: pybullet.getJointInfo(body, i, physicsClientId=client)[16] for i in ids.values()}
    owners: dict[int, tuple[int, bool]] = {}
    for f, tip_link in enumerate(hand.tip_links):
        moved = {ids[hand.model.names[j]] for j in hand.chain_joints[f]}
        link = links[tip_link]
        shaped = bool(pybullet.getCollisionShapeData(body, link, physicsClientId=client))
        owners[link] = (f, True)
        while link not in moved:
            link = parent[link]
            owners[link] = (f, not shaped)  # a bare frame's body is the one that it is fixed to
        while link in moved or parent[link] in moved:
            owners.setdefault(link, (f, False))
            link = parent[link]
    # What is fixed to a finger's link is part of it; where the tip is a bare frame, of the tip.
    for link in sorted(parent):
        above = parent[link]
        if link not in owners and above in owners and _is_fixed(client, body, link):
            owners[link] = owners[above]
    return owners


def _is_fixed(client: int, body: int, link: int) -> bool:
    info = pybullet.getJointInfo(body, link, physicsClientId=client)
    return bool(info[2] == pybullet.JOINT_FIXED)


def couple(client: int, body: int, hand: HandModel, ids: dict[str, int], joints: FloatArray) -> None:
    """Let joints that follow others (mimic) do so by gears without play, which carry torques too."""
    at = dict(zip(hand.joint_names, joints, strict=True))
    for follower in hand.followers:
        own, leader = ids[follower.name], ids[follower.leader]
        position = follower.ratio * at[follower.leader] + follower.offset
        pybullet.resetJointState(body, own, position, 0.0, physicsClientId=client)
        pybullet.setJointMotorControl2(
            body, own, pybullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client
        )
        gear = pybullet.createConstraint(
            body,
            own,
            body,
            leader,
            jointType=pybullet.JOINT_GEAR,
            jointAxis=[0.0, 0.0, 1.0],
            parentFramePosition=[0.0, 0.0, 0.0],
            childFramePosition=[0.0, 0.0, 0.0],
            physicsClientId=client,
        )
        # Bullet holds own + gearRatio * leader at the target.
        pybullet.changeConstraint(
            gear,
            gearRatio=-follower.ratio,
            relativePositionTarget=follower.offset,
            erp=_GEAR_ERP,
            maxForce=_GEAR_FORCE,
            physicsClientId=client,
        )
