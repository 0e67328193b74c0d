"""How commands end when a signal asks them to: Ctrl-C, SIGTERM and SIGHUP alike."""

import _thread
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_AGAIN_S = 0.05

# Signals that came, since their exception may be lost: a library may catch everything.
_asked: list[signal.Signals] = []


def end_on_signals() -> None:
    """Let each signal raise `KeyboardInterrupt`; one that is ignored, as under nohup, stays so.

    While a library is being loaded nothing may be raised: callbacks drop it, compiled modules crash of it.
    The signal then comes again a moment later. So it does where compiled code or a destructor can't let the
    exception pass: Python would print it and go on.
    """
    _asked.clear()
    if threading.current_thread() is not threading.main_thread():
        return
    sys.unraisablehook = partial(_unraisable, sys.unraisablehook)
    for each in _SIGNALS:
        if signal.getsignal(each) is not signal.SIG_IGN:
            signal.signal(each, _interrupt)


@contextmanager
def interruptible(stop: threading.Event) -> Iterator[None]:
    """Let the first signal set ``stop`` and the second one raise `KeyboardInterrupt`.

    Ctrl-C is heard here even where it is ignored at first, as in a shell's background.

    Raises:
        KeyboardInterrupt: A signal came before, and its exception was lost.
    """
    from graspbench.cli.printing import err

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()
        err.print("finishing the trials that are running; Ctrl-C again ends them at once")

    ignored = {each for each in _SIGNALS if signal.getsignal(each) is signal.SIG_IGN} - {signal.SIGINT}
    before = {each: signal.signal(each, interrupt) for each in _SIGNALS if each not in ignored}
    try:
        if _asked:
            _asked.clear()  # it need not come again
            raise KeyboardInterrupt
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def _interrupt(number: int, frame: FrameType | None) -> None:
    _asked.append(signal.Signals(number))
    if not _is_loading(frame):
        raise KeyboardInterrupt
    _come_again()


def _unraisable(hook: Callable[["sys.UnraisableHookArgs"], object], lost: "sys.UnraisableHookArgs") -> None:
    if not _asked:
        hook(lost)
    elif issubclass(lost.exc_type, KeyboardInterrupt):
        _come_again()
    # else the exception met an object half made, whose destructor misses what has not been set


def _come_again() -> None:
    again = threading.Timer(_AGAIN_S, _ask_again)
    again.daemon = True
    again.start()


def _ask_again() -> None:
    if _asked:
        _thread.interrupt_main(_asked[-1])  # the same one: others may be ignored


def _is_loading(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False
