import time

import pytest

from graspbench.trial.clock import StageClock


def test_interleaved_stages_get_their_own_times():
    heard = []
    clock = StageClock(lambda name, seconds: heard.append(name))

    def produce():
        for item in range(3):
            time.sleep(0.02)
            yield item

    kept = []
    with clock.stage("both"):
        for _ in clock.producing("producer", produce(), kept):
            time.sleep(0.05)
    assert kept == [0, 1, 2]
    assert heard == ["producer", "both"]
    assert clock.seconds["producer"] == pytest.approx(0.06, abs=0.045)
    assert clock.seconds["both"] > clock.seconds["producer"] + 0.14


def test_an_abandoned_producer_is_still_timed():
    clock = StageClock()
    stream = clock.producing("p", iter(range(5)), [])
    next(stream)
    stream.close()
    assert clock.seconds["p"] > 0
