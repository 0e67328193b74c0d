"""Fixed-step integration of the loop, with a choice of order."""

from typing import TYPE_CHECKING, NamedTuple

from graspbench.arrays import FloatArray
from graspbench.manipulation.pose_sample import PoseSample

if TYPE_CHECKING:
    from graspbench.manipulation.clik import Clik


class RungeKutta(NamedTuple):
    """An explicit rule whose stages each use the stage before only.

    Attributes:
        order: Order of accuracy.
        nodes: Where in the period each stage lies; also the weight of the stage before it.
        weights: Share of each stage in the step.
    """

    order: int
    nodes: tuple[float, ...]
    weights: tuple[float, ...]


INTEGRATORS = {
    "euler": RungeKutta(1, (0.0,), (1.0,)),
    "heun": RungeKutta(2, (0.0, 1.0), (0.5, 0.5)),
    "rk4": RungeKutta(4, (0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
}


def step(
    clik: "Clik",
    rule: RungeKutta,
    time_s: float,
    period_s: float,
    joints: FloatArray,
    contacts: FloatArray,
    velocity: FloatArray,
    desired: PoseSample | None,
) -> tuple[FloatArray, FloatArray]:
    """Return joints and contact variables one period later.

    Args:
        clik: The control law, evaluated at the start of the period.
        rule: The integration rule.
        time_s: Start of the period.
        period_s: Its length.
        joints: Joints at its start, shape (n_q,).
        contacts: Contact variables at its start, shape (n_c, 5).
        velocity: z' at its start.
        desired: The reference if it is held over the period, None if it runs on.
    """
    joint_rate, contact_rate = velocity[: len(joints)], clik.contact_rates
    if rule.order == 1:
        return joints + period_s * joint_rate, contacts + period_s * contact_rate
    joint_sum, contact_sum = rule.weights[0] * joint_rate, rule.weights[0] * contact_rate
    for node, weight in zip(rule.nodes[1:], rule.weights[1:], strict=True):
        dt = node * period_s
        at = clik.reference(time_s + dt) if desired is None else desired
        velocity = clik.respond(time_s + dt, at, joints + dt * joint_rate, contacts + dt * contact_rate)
        joint_rate = velocity[: len(joints)]
        joint_sum = joint_sum + weight * joint_rate
        contact_sum = contact_sum + weight * contact_rate
    return joints + period_s * joint_sum, contacts + period_s * contact_sum
