"""What came of a trial, in a sentence."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from graspbench.results.physical_results import ExecutedResult
    from graspbench.results.trial_result import TrialResult


def verdict(result: "TrialResult") -> str:
    """Say whether the object was held, or where and why it was lost; sliding and pushes."""
    if result.manipulation is not None:
        within = f"within {1e3 * result.manipulation.position_error_max_m:.2g} mm"
        if result.gait is not None:
            turned = f"The object is turned by {result.gait.turned_deg:.0f} deg {within}"
            return f"{turned}{_walked(result)}.{_instead(result)}"
        played = "" if result.in_hand is None else ", and was held through it in physics"
        slid = ""
        if result.sliding is not None:
            slid = f", fingertips slide over it by up to {1e3 * result.sliding.slid_max_m:.1f} mm"
        return f"The object moved as asked {within}{slid}{played}."
    execution = result.execution
    if execution is None:
        return "A grasp was planned; nothing was executed."
    if not execution.success:
        return f"Lost{_where(execution)}: {execution.reason}.{_instead(result)}"
    return f"Held{_phases(execution)}{_sliding(execution)}{_pushes(execution)}.{_instead(result)}"


def _walked(result: "TrialResult") -> str:
    """Say how often fingers step in a gait, and what came of it in physics."""
    gait, played = result.gait, result.in_hand
    assert gait is not None, "the caller has looked"
    said = ", and no finger has to step" if gait.steps == 0 else f" with {gait.steps} steps of single fingers"
    if played is None or played.turned_about_axis_deg is None:
        return said
    slid = "" if not played.fingers_slipped else f", {played.fingers_slipped} finger(s) slipped"
    missed = "" if not played.steps_missed else f", {played.steps_missed} step(s) missed it"
    turned = f"turned by {played.turned_about_axis_deg:.1f} deg"
    return f"{said}; in physics it was held and {turned}{slid}{missed}"


def _instead(result: "TrialResult") -> str:
    """Say that it was not the planner's own grasp, where it was not."""
    felt = result.explored
    if felt is not None:
        name = f"{felt.measure[0].upper()}{felt.measure[1:]}"
        grasps = f"{felt.grasps} exploring grasps" if felt.grasps > 1 else "one exploring grasp"
        told = f"it felt a {name} of {felt.value:.2g}, the first {felt.first:.2g}"
        return f" Of {grasps} the best was executed; {told}."
    instead, planned = result.strengthened, result.local
    if instead is None or planned is None:
        return ""
    there = f"where the planned one's is {planned.q3:.2g}"
    if instead.for_gait:
        return f" The planned grasp has no gait: another was executed, of Q3 {instead.q3:.2g} {there}."
    if instead.for_way:
        return f" No way led to the planned grasp: another was executed, of Q3 {instead.q3:.2g} {there}."
    return f" A strengthened grasp was executed, of Q3 {instead.q3:.2g} {there}."


def _where(execution: "ExecutedResult") -> str:
    lost = next((name for name, phase in execution.phases.items() if not phase.held), None)
    if lost is not None:
        return f" in the phase {lost}"
    return "" if execution.phases else " before it was lifted"


def _phases(execution: "ExecutedResult") -> str:
    names = list(execution.phases)
    return f" through {', '.join(names)}" if names else f" by {execution.contacts_made} fingers in touch"


def _sliding(execution: "ExecutedResult") -> str:
    if not execution.phases:
        return ""
    slip_mm = 1e3 * max(phase.slip_m for phase in execution.phases.values())
    return f"; the contacts slid by up to {slip_mm:.2g} mm"


def _pushes(execution: "ExecutedResult") -> str:
    if execution.largest_push_weight is None:
        return ""
    return f"; it resists {execution.largest_push_weight:.2g} times its weight in the weakest direction"
