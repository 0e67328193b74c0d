import threading
import time

import numpy as np
import pytest

from graspbench.errors import ReconstructionError
from graspbench.planning.concurrent import ConcurrentSurfaces, TimedSurfaces
from graspbench.reconstruction.network import build_network
from graspbench.reconstruction.surface import Surface

NETWORK = build_network(3, 1)


def snapshots(count, pause_s=0.0, fail=False):
    for k in range(count):
        time.sleep(pause_s)
        yield Surface(np.zeros((5, 3)), np.zeros((5, 3)), np.zeros(3), NETWORK, k, k == count - 1)
    if fail:
        raise ReconstructionError("the surface broke")


def test_lockstep_gives_every_surface_and_measures_their_making():
    source = TimedSurfaces(snapshots(4, 0.01))
    assert [surface.iteration for surface in source] == [0, 1, 2, 3]
    assert source.made == 4
    assert source.busy_s >= 0.04


def test_slow_planner_sees_every_surface_and_does_not_hold_up_their_making():
    source = ConcurrentSurfaces(snapshots(50))
    seen = []
    for surface in source:
        seen.append(surface.iteration)
        time.sleep(0.005)
        if len(seen) == 25:
            assert source.made == 50
    assert seen == list(range(50))


def test_fast_planner_sees_every_surface():
    assert [surface.iteration for surface in ConcurrentSurfaces(snapshots(5, 0.02))] == [0, 1, 2, 3, 4]


def test_both_work_at_the_same_time():
    names = set()

    def made():
        for surface in snapshots(3):
            names.add(threading.current_thread().name)
            yield surface

    for _ in ConcurrentSurfaces(made()):
        names.add(threading.current_thread().name)
    assert len(names) == 2


def test_errors_of_the_reconstruction_reach_the_planner():
    with pytest.raises(ReconstructionError, match="the surface broke"):
        list(ConcurrentSurfaces(snapshots(2, fail=True)))


def test_a_planner_that_gives_up_ends_the_thread():
    before = threading.active_count()
    source = iter(ConcurrentSurfaces(snapshots(1000, 0.001)))
    next(source)
    source.close()
    assert threading.active_count() == before


def test_no_surfaces():
    assert list(ConcurrentSurfaces(iter(()))) == []
