"""Libraries written in C print when they like; nothing but the program itself writes to its output."""

import ctypes
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager


class Captured:
    """What was printed; complete when the block has ended.

    Attributes:
        text: Output and errors.
    """

    text: str = ""


@contextmanager
def captured_output() -> Iterator[Captured]:
    """Keep what a C library prints in the block from the process' standard output and error.

    The descriptors themselves are redirected: Python's own streams are not the way that it takes.
    """
    c_library = ctypes.CDLL(None)
    captured = Captured()
    _flush(c_library)
    kept = [os.dup(descriptor) for descriptor in (1, 2)]
    with tempfile.TemporaryFile() as file:
        try:
            for descriptor in (1, 2):
                os.dup2(file.fileno(), descriptor)
            yield captured
        finally:
            _flush(c_library)
            for descriptor, before in zip((1, 2), kept, strict=True):
                os.dup2(before, descriptor)
                os.close(before)
            file.seek(0)
            captured.text = file.read().decode(errors="replace")


def _flush(c_library: ctypes.CDLL) -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    c_library.fflush(None)
