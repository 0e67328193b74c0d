"""Work that another process does while this one goes on.

What Python computes keeps other threads of its process waiting, so work that nobody waits for is given to a
process of its own. That one is an interpreter started anew, not a copy of this one: a copy made while threads
run (those of OpenCV, of a progress bar) may find their locks taken for ever. It loads what it needs while
this process does other things, and it ends when this one does.
"""

import json
import os
import pickle
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from importlib import import_module
from queue import SimpleQueue
from types import TracebackType
from typing import Any, Self

# Modules are found where this process finds them, and never in the folder that it happens to be in (-P).
_MAIN = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); "
    "from graspbench.beside import serve; serve(sys.argv[2])"
)
_SIZE = 8  # bytes before each piece of work: its length


class Beside:
    """Does work in a process beside this one, or here, with the same results; a context manager.

    Args:
        module: Where the work's function is; the other process begins with loading it at once.
        wanted: Whether there shall be another process. Without one the work is done when it is asked for.
    """

    def __init__(self, module: str, wanted: bool = True) -> None:
        self._module = module
        self._process = _started(module) if wanted else None
        self._work: list[tuple[str, tuple[Any, ...]]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def start(self, function: str, *arguments: object) -> None:
        """Give it a piece of work, to be done after those that it has been given before.

        Args:
            function: Name of the module's function. It does no harm to call it twice.
            arguments: What it is called with. Where they cannot be pickled all of the work is done here.
        """
        self._work.append((function, arguments))
        try:
            self._send(pickle.dumps((function, arguments), pickle.HIGHEST_PROTOCOL))
        except (pickle.PicklingError, TypeError, AttributeError):
            self.stop()

    def results(self) -> list[Any]:
        """Wait for the work and return what each piece gives; do it here where the other process could not.

        Raises:
            Exception: What the work raises.
        """
        work, self._work = self._work, []
        self._send(b"")
        if self._process is not None and self._process.stdout is not None:
            answer = self._process.stdout.read()
            self.stop()
            with suppress(EOFError, pickle.UnpicklingError):
                given: list[Any] = pickle.loads(answer)  # from a process of our own
                return given
        return [_done(self._module, function, arguments) for function, arguments in work]

    def _send(self, task: bytes) -> None:
        """Send a piece of work; an empty one says that there will be no more."""
        if self._process is None or self._process.stdin is None:
            return
        try:
            self._process.stdin.write(len(task).to_bytes(_SIZE, "little") + task)
            self._process.stdin.flush()
        except OSError:
            self.stop()  # it will be done here

    def stop(self) -> None:
        """End the other process, done or not."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        process.wait()


def _done(module: str, function: str, arguments: tuple[Any, ...]) -> Any:
    return getattr(import_module(module), function)(*arguments)


def _started(module: str) -> subprocess.Popen[bytes] | None:
    if not sys.executable:  # Python is part of another program
        return None
    try:
        return subprocess.Popen(
            [sys.executable, "-P", "-c", _MAIN, json.dumps(sys.path), module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # what goes wrong there is done again here, and told
            process_group=0,  # Ctrl-C is for this process, which then ends the other
        )
    except OSError:
        return None


def serve(module: str) -> None:
    """Be the other process: load a module, do the work that comes in, print what it gives, pickled."""
    from graspbench.loading import load_quickly

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    load_quickly()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing that libraries print gets into the answer
    inbox: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_listen, args=(inbox,), daemon=True).start()
    import_module(module)
    given = [_done(module, *pickle.loads(task)) for task in iter(inbox.get, b"")]
    answers.write(pickle.dumps(given, pickle.HIGHEST_PROTOCOL))
    answers.close()


def _listen(inbox: SimpleQueue[bytes]) -> None:
    """Take the work in; end this process as soon as the one that asked has closed the line, or is no more."""
    source = sys.stdin.buffer
    while len(size := source.read(_SIZE)) == _SIZE:
        inbox.put(source.read(int.from_bytes(size, "little")))
    os._exit(1)
