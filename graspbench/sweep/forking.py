"""The process that forks workers: what it loads, it loads once for all of them."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import forkserver, resource_tracker

from graspbench.threads import single_threaded_pools


def start_forkserver(preloaded: str) -> None:
    """Start the process that forks workers with Ctrl-C blocked, as they inherit it; once for a program.

    Ctrl-C goes to the whole process group: a worker that is still loading would die of it.

    Args:
        preloaded: The module that it loads, while this process goes on.
    """
    forkserver.set_forkserver_preload([preloaded])
    resource_tracker.ensure_running()  # here, since its start lets Ctrl-C through again
    with interrupts_blocked(), single_threaded_pools():
        forkserver.ensure_running()


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Block Ctrl-C in this thread: threads and processes that it starts inherit that for good."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
