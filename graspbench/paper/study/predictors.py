"""What could foretell how a grasp fares: every registered measure, robust ones, and the posture's margins."""

import numpy as np

from graspbench.grasp.configuration import Grasp
from graspbench.grasp.internal_forces import friction_reserve
from graspbench.grasp.measure import MEASURES, evaluate_measures
from graspbench.grasp.quality import QualityParameters
from graspbench.hand.model import HandModel
from graspbench.planning.parameters import RobustParameters
from graspbench.planning.robustness import Robustness
from graspbench.reconstruction.surface import Surface

ROBUST = ("expected_q3", "fifth_percentile_q3", "closure_share", "friction_reserve")
POSTURE = ("joint_margin", "smallest_singular_value", "clearance", "manipulability", "force_reach")

SMALLER_IS_BETTER = ("polygon_irregularity", "centre_distance")


def predictor_names() -> tuple[str, ...]:
    """Return the names of all predictors, measures first."""
    return (*MEASURES.names(), *ROBUST, *POSTURE)


def predictors(
    grasp: Grasp, surface: Surface, hand: HandModel, quality: QualityParameters, samples: int = 60
) -> dict[str, float]:
    """Return every predictor of a grasp that is defined for it.

    Args:
        grasp: The grasp, with its posture.
        surface: The finished surface.
        hand: The hand.
        quality: Contact model and friction.
        samples: Errors drawn for the robust ones.
    """
    length_m = quality.torque_length_m(surface.points, surface.centroid)
    found = {
        name: float(value)
        for name, value in evaluate_measures(
            MEASURES.names(), grasp.points, -grasp.normals, surface.centroid, quality, length_m
        ).items()
    }
    errors = Robustness(surface, quality, RobustParameters(samples=samples)).samples_q3(grasp.vertices)
    found["expected_q3"] = float(errors.mean())
    found["fifth_percentile_q3"] = float(np.quantile(errors, 0.05))
    found["closure_share"] = float(np.mean(errors > 0.0))
    arms = grasp.points - surface.centroid
    found["friction_reserve"] = friction_reserve(arms, -grasp.normals, quality.friction)
    posture = grasp.posture
    assert posture is not None, "a grasp of the study has a posture"
    fingers = list(posture.fingers)
    found["joint_margin"] = posture.joint_margin
    found["smallest_singular_value"] = posture.smallest_singular_value
    found["clearance"] = posture.clearance_m
    found["manipulability"] = float(hand.manipulability(posture.joints)[fingers].min())
    found["force_reach"] = _force_reach(grasp, hand)
    return found


def _force_reach(grasp: Grasp, hand: HandModel) -> float:
    """Return the least torque transmission along a contact's normal, 1/m: large where joints turn little.

    Chiu's force transmission ratio of each finger along its contact normal (1988); the least finger counts.
    """
    posture = grasp.posture
    assert posture is not None
    jacobians = hand.tip_jacobians(posture.joints)
    turn = posture.transform_palm_to_world[:3, :3]
    ratios = []
    for contact, finger in enumerate(posture.fingers):
        normal = turn.T @ grasp.normals[contact]
        torques = jacobians[finger].T @ normal
        ratios.append(1.0 / max(float(np.linalg.norm(torques)), 1e-6))
    return min(ratios)
