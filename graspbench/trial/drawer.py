"""Who draws a trial's pictures while the trial goes on; loads next to nothing."""

from graspbench.beside import Beside
from graspbench.threads import threads_available


def drawer(*, beside: bool) -> Beside:
    """Return who does the work of `graspbench.trial.pictures`.

    Args:
        beside: In a process beside this one, if there is a core for it, which begins to load at once. The
            pictures are the same; it spares a process that runs one trial from loading Matplotlib and from
            waiting.
    """
    return Beside("graspbench.trial.pictures", wanted=beside and threads_available() > 1)
