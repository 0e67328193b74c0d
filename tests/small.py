"""Options of trials that cost little, for tests of what comes after their pictures."""

SMALL_PICTURES = (
    "camera.width=160", "camera.height=120", "camera.fx=150", "camera.fy=150", "stations.outer.count=4",
    "stations.inner.count=0",
)  # fmt: skip
"""Four pictures of 160 x 120: a trial takes a quarter of the time of one with thirteen of 640 x 480."""

SHORT_EXECUTION = (
    "execution.squeeze_time_s=0.2", "execution.lift_time_s=0.3", "execution.rotation_time_s=0.3",
    "execution.hold_time_s=0.05", "execution.shake_time_s=0.1", "execution.push_time_s=0.05",
)  # fmt: skip
"""Every phase of an execution, none for long; not for what must hold."""

SMALL_TRIAL = (
    "search.enabled=false", "execution=off", "surface.meridians=12", "surface.parallels=10", *SMALL_PICTURES,
)  # fmt: skip
"""Planned on a coarse surface, nothing searched or executed: about a third of a second."""
