"""Evaluations in several processes begin before all is loaded here: loading takes as long as 50 grasps."""

from graspbench.sweep.forking import start_forkserver


def start_evaluation_workers() -> None:
    """Let the process that forks workers load what they need while this one loads what it needs itself."""
    start_forkserver("graspbench.experiment.evaluation_preload")
