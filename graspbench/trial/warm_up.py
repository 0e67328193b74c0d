"""Compile the inner loops ahead of the first trial, on two cores.

``python -m graspbench.trial.warm_up`` does it. Compiled code is kept on disk, so this is needed once
after an installation. Without it the first trial compiles what it needs.
"""

import tempfile
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

# The kernels are those of any trial; its size does not matter.
_COARSE = (
    "camera.width=160", "camera.height=120", "camera.fx=150", "camera.fy=150", "stations.outer.count=4",
    "stations.inner.count=0", "surface.meridians=12", "surface.parallels=10", "planner.candidates=2",
    "planner.planes=2",
)  # fmt: skip

_TIME_LIMIT_S = 600.0
"""Of searches that take a second once they are compiled; compiling counts, and must come to its end."""

if TYPE_CHECKING:
    from graspbench.reconstruction.surface import Surface


def main() -> None:
    """Compile what each part of a trial takes, all at the same time.

    Who needs a kernel that another one is compiling waits for it (`graspbench.kernel_cache`), so the work is
    spread evenly whatever each kernel takes.
    """
    work_together(warm_up_planner, warm_up_search, warm_up_hand, warm_up_trial)


def work_together(here: Callable[[], object], *beside: Callable[[], object]) -> None:
    """Do one piece of work in this process and each other one in a process of its own; wait for all.

    Raises:
        SystemExit: One of the other processes did not end well; the message says which.
    """
    context = get_context("spawn")
    others = [context.Process(target=work, name=work.__name__) for work in beside]
    for other in others:
        other.start()
    here()
    for other in others:
        other.join()
    ended = [f"{other.name} ended with {other.exitcode}" for other in others if other.exitcode]
    if ended:
        raise SystemExit(f"warm-up: {', '.join(ended)}")


def warm_up_trial() -> None:
    """Compile what else a trial with pictures runs through: images, surface, paths, drawing, table."""
    from graspbench.config.trial_config import load_config
    from graspbench.errors import TrialError
    from graspbench.results.store import ResultStore
    from graspbench.trial.runner import run_and_store

    config = load_config([*_COARSE, "search.enabled=false", "execution.until=contact"])
    with tempfile.TemporaryDirectory(prefix="graspbench-") as folder:
        result = run_and_store(config, store := ResultStore(Path(folder)))
        store.write_table()
        if result.status != "done":
            raise TrialError(f"the first trial failed: {result.reason}")


def warm_up_planner() -> None:
    """Compile what plans on a surface without a hand."""
    from graspbench.config.trial_config import load_config
    from graspbench.planning import make_index, plan_local

    config = load_config(["planner.candidates=1", "planner.planes=1"])
    index = make_index(config.index_name, config.index, 3, config.quality)
    plan_local([_ball()], index, None, 3, config.local_planner, config.quality)


def warm_up_search() -> None:
    """Compile what searches all grasps of a surface, with the configured model and with the thesis'."""
    from graspbench.config.trial_config import load_config
    from graspbench.planning import SearchParameters, plan_global

    for quality in (load_config().quality, load_config(["quality=thesis"]).quality):
        for measure in ("q1", "q3"):
            plan_global(_ball(), measure, 3, quality, SearchParameters(time_limit_s=_TIME_LIMIT_S))


def warm_up_hand() -> None:
    """Compile what places a hand on contacts."""
    import numpy as np

    from graspbench.config.trial_config import load_config
    from graspbench.hand import GraspChecker, load_hand

    surface = _ball()
    checker = GraspChecker(load_hand(load_config().hand))
    checker.set_object(surface.points, surface.network.faces)
    angles = np.deg2rad([90.0, 210.0, 330.0])
    normals = np.stack((np.cos(angles), np.sin(angles), np.zeros(3)), axis=1)
    posture = checker.place(surface.centroid + 0.03 * normals, normals)
    checker.place(surface.centroid + 0.03 * normals, normals, start=posture)


def _ball() -> "Surface":
    import numpy as np

    from graspbench.reconstruction import Ellipsoid, build_network
    from graspbench.reconstruction.sampling import sample_ellipsoid
    from graspbench.reconstruction.surface import Surface

    network, centre = build_network(12, 12), np.array([0.0, 0.0, 0.05])
    points = sample_ellipsoid(Ellipsoid(centre, np.eye(3), np.full(3, 0.03)), network, 0.3)
    return Surface(points, (points - centre) / 0.03, centre, network, 0, True)


if __name__ == "__main__":
    main()
